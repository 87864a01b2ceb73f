// IncrementalSmoother: which landmarks sightings show, and which of them are one, or none.
#include <algorithm>
#include <array>
#include <cmath>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/incremental/incremental_belief.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// An observation and the landmark of the map that it shows, or may show.
struct Match {
  std::size_t observation;
  int landmark;
};

/// Of some matches, two numbers each: (range, bearing), and the covariance of all together.
struct Innovations {
  Eigen::VectorXd innovation;
  MatrixXd S;
};

/// By what is known before the sightings count: docs/theory/online-smoother.md, eq. 24.
Innovations innovations(std::span<const Match> matches, std::span<const Observation> observations,
                        const IncrementalBelief& belief) {
  const Index numbers = 2 * static_cast<Index>(matches.size());
  Innovations result{Eigen::VectorXd(numbers), {}};
  if (matches.empty()) return result;
  const FactorGraph& graph = belief.graph;
  const Pose2 pose = pose_now(belief);
  const Matrix3 axes = world_from_body_axes(pose);
  std::vector<EliminationTree::Derivative> derivatives;
  MatrixXd by_body(numbers, 3);
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const auto [observation, landmark] = matches[k];
    const auto row = 2 * static_cast<Index>(k);
    const ExpectedReading expected =
        expected_reading(pose, graph.sensor().body_from_sensor, graph.landmark_at(landmark));
    result.innovation.segment<2>(row) = innovation_of(observations[observation], expected);
    derivatives.push_back({graph.landmark_variable(landmark), row, expected.by_landmark.transpose()});
    by_body.middleRows<2>(row) = expected.by_pose * axes;
  }
  append_by_body(belief, by_body, 0, derivatives);
  result.S = graph.covariance(derivatives, numbers);
  result.S += by_body * belief.since.motion.covariance * by_body.transpose();
  const Matrix2 R = reading_covariance(graph.sensor());
  for (Index row = 0; row < numbers; row += 2) result.S.block<2, 2>(row, row) += R;
  return result;
}

/// −1: none of the map.
int landmark_of(std::size_t i, const Observation& observation, const IncrementalBelief& belief) {
  return observation.landmark < 0 ? static_cast<int>(belief.unidentified.shown_by(i))
                                  : belief.table.identified(observation.landmark);
}

/// Where the sighting shows it.
int add_landmark(const Observation& observation, IncrementalBelief& belief) {
  const int landmark = belief.graph.add_landmark(observation);
  if (observation.landmark >= 0)
    belief.table.add_identified(observation.landmark);
  else
    belief.table.add_unidentified(belief.graph.landmark_at(landmark), pose_now(belief).translation());
  return landmark;
}

void remove_landmark(int landmark, IncrementalBelief& belief) {
  const int variable = belief.graph.landmark_variable(landmark);
  belief.graph.remove_landmark(landmark);
  belief.seen_together.remove(variable);
  belief.table.remove(landmark);
}

/// What was taken for the one that goes shows the other.
void merge(int kept, int gone, IncrementalBelief& belief) {
  LandmarkTable& table = belief.table;
  const LandmarkId id = table.id_of(gone);
  if (table.existence(gone).log_odds > table.existence(kept).log_odds)
    table.existence(kept) = table.existence(gone);
  table.add_sightings(kept, table.sightings(gone));
  belief.merged_into[id] = table.id_of(kept);
  belief.seen_together.merge(belief.graph.landmark_variable(kept), belief.graph.landmark_variable(gone));
  belief.graph.merge_landmarks(kept, gone);
  for (ObservationReport& report : belief.report.observations)
    if (report.landmark == id) report.landmark = table.id_of(kept);
  remove_landmark(gone, belief);
}

/// Landmarks that may be one: of each in view, by its place among them, those of the map nearby.
struct Duplicates {
  std::vector<std::pair<int, int>> pairs;
  JointReadings differences;  ///< of their places
};

/// docs/theory/online-smoother.md, eq. 25.
Duplicates possible_duplicates(const IncrementalBelief& belief) {
  const FactorGraph& graph = belief.graph;
  const LandmarkTable& table = belief.table;
  Duplicates found;
  std::vector<EliminationTree::Derivative> derivatives;
  std::vector<std::size_t> near;
  for (const int variable : graph.in_view()) {
    const int a = graph.landmark_of_variable(variable);
    const double sigma_m = std::sqrt(graph.landmark_covariance(a).trace());
    table.grid().near(graph.landmark_at(a), kDuplicateSigmas * sigma_m + table.off_grid_m(), kMostShown,
                      near);
    for (const std::size_t n : near) {
      const int b = static_cast<int>(n);
      if (a == b || belief.seen_together.has(a, b, graph)) continue;
      const auto column = 2 * static_cast<Index>(found.pairs.size());
      derivatives.push_back({variable, column, Matrix2::Identity()});
      derivatives.push_back({graph.landmark_variable(b), column, -Matrix2::Identity()});
      found.differences.pairings.push_back({found.differences.observations, n});
      found.pairs.emplace_back(a, b);
    }
    ++found.differences.observations;
  }
  const Index numbers = 2 * static_cast<Index>(found.pairs.size());
  if (numbers == 0) return found;
  found.differences.S = graph.covariance(derivatives, numbers);
  found.differences.innovation.resize(numbers);
  for (std::size_t p = 0; p < found.pairs.size(); ++p)
    found.differences.innovation.segment<2>(2 * static_cast<Index>(p)) =
        graph.landmark_at(found.pairs[p].first) - graph.landmark_at(found.pairs[p].second);
  return found;
}

/// Those that are explained by one another. False: none is.
bool merge(const JointExplanation& explanation, const Duplicates& duplicates, IncrementalBelief& belief) {
  const LandmarkTable& table = belief.table;
  std::vector<std::pair<LandmarkId, LandmarkId>> ids;  // numbers change with each that goes
  for (const int p : explanation.pairing)
    if (p >= 0) {
      const auto& [a, b] = duplicates.pairs[nth(p)];
      ids.emplace_back(table.id_of(a), table.id_of(b));
    }
  for (const auto& [first, second] : ids) {
    const int a = table.with_id(first), b = table.with_id(second);
    const bool keeps_a = table.is_identified(a) || first < second;
    merge(keeps_a ? a : b, keeps_a ? b : a, belief);
  }
  return !ids.empty();
}

/// Landmarks in view that most probably are others of the map, all of them together, as surely as a landmark
/// is confirmed. False: there are none.
bool merge_duplicates(IncrementalBelief& belief) {
  const IncrementalSmootherOptions& options = belief.options;
  const Duplicates duplicates = possible_duplicates(belief);
  if (duplicates.pairs.empty()) return false;
  const std::vector<double> limits = joint_limits(options.gate, duplicates.differences.observations);
  const std::vector<JointExplanation> explanations = most_probable_explanations(
      duplicates.differences, {.none = cost_of_any_place(belief.graph.sensor().max_range_m),
                               .limit = limits,
                               .most = 2,
                               .within = 2.0 * Existence::kConfirmed});
  return explanations.size() == 1 && merge(explanations.front(), duplicates, belief);
}

}  // namespace

void associate(std::span<const Observation> observations, IncrementalBelief& belief) {
  UnidentifiedSightings& unidentified = belief.unidentified;
  unidentified.begin(observations);
  if (unidentified.observations().empty()) return;
  if (belief.table.off_grid_m() > kOffGridShare * belief.graph.sensor().max_range_m)
    belief.table.refresh_grid([&](int landmark) { return belief.graph.landmark_at(landmark); });
  const auto near =
      unidentified.candidates(estimate_of(belief), belief.table.grid(), belief.table.off_grid_m());
  std::vector<Match> matches;
  for (std::size_t k = 0; k < near.size(); ++k)
    for (const std::size_t landmark : near[k])
      matches.push_back({unidentified.observations()[k], static_cast<int>(landmark)});
  const Innovations all = innovations(matches, observations, belief);
  std::vector<Index> rows;  // of pairings
  Index row = 0;
  for (std::size_t k = 0; k < near.size(); ++k)
    for (const std::size_t landmark : near[k]) {
      if (unidentified.consider(k, landmark, all.innovation.segment<2>(row), all.S.block<2, 2>(row, row)))
        rows.insert(rows.end(), {row, row + 1});
      row += 2;
    }
  unidentified.decide(all.innovation(rows), all.S(rows, rows), belief.report);
}

void gate(std::span<const std::size_t> shown, std::span<const Observation> observations,
          IncrementalBelief& belief) {
  std::vector<Match> known;
  for (const std::size_t i : shown) {
    belief.report.observations[i].decision = Decision::created;
    const int landmark = landmark_of(i, observations[i], belief);
    if (landmark >= 0) known.push_back({i, landmark});
  }
  const Innovations all = innovations(known, observations, belief);
  for (std::size_t k = 0; k < known.size(); ++k) {
    ObservationReport& report = belief.report.observations[known[k].observation];
    const auto row = 2 * static_cast<Index>(k);
    const Matrix2 S = all.S.block<2, 2>(row, row);
    report.innovation = all.innovation.segment<2>(row);
    report.nis = squared_mahalanobis(report.innovation, S);
    report.decision = report.nis <= belief.options.gate ? Decision::matched : Decision::rejected;
  }
}

void add_sighting(std::size_t i, const Observation& observation, IncrementalBelief& belief) {
  int landmark = landmark_of(i, observation, belief);
  ObservationReport& report = belief.report.observations[i];
  if (landmark < 0) {
    landmark = add_landmark(observation, belief);
  } else if (report.decision == Decision::created) {
    report.decision = Decision::matched;  // the step's first sighting of it made it
  }
  if (observation.landmark < 0) belief.unidentified.show(i, nth(landmark));
  report.landmark = belief.table.id_of(landmark);
  belief.table.add_sightings(landmark, 1);
  belief.graph.add_sighting(landmark, observation);
}

void revise_map(IncrementalBelief& belief) {
  if (belief.unidentified.observations().empty()) return;
  const auto existence = [&](std::size_t landmark) -> Existence& {
    return belief.table.existence(static_cast<int>(landmark));
  };
  const std::vector<std::size_t> gone = belief.unidentified.update_existence(
      pose_now(belief), belief.report, belief.table.grid(), belief.table.visibility(), existence);
  for (const std::size_t landmark : gone) remove_landmark(static_cast<int>(landmark), belief);
  if (!gone.empty()) settle(belief);
  while (merge_duplicates(belief)) settle(belief);
}

}  // namespace trundle::slam
