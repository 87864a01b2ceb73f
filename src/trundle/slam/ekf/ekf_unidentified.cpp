// EkfSlam, where sightings have no id.
#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/slam/ekf/ekf.hpp"

namespace trundle::slam {
namespace {

// Of the sensor's range: landmarks that have moved further in the map are put into the grid again. What is
// looked up is as much wider, twice; so a wrong share costs time and no match.
constexpr double kOffGridShare = 0.05;

}  // namespace

/// Which landmark each shows: the most probable explanation of all of them together. Eq. 21, 22.
void EkfSlam::associate_unidentified() {
  std::vector<std::size_t>& observations = unidentified_.observations;
  observations.clear();
  matched_to_.assign(observations_.size(), EkfBelief::kNone);
  for (std::size_t i = 0; i < observations_.size(); ++i)
    if (observations_[i].landmark < 0 && is_valid(observations_[i])) observations.push_back(i);
  if (observations.empty()) return;
  find_candidates();
  pair_candidates();
  const double least = cost_at_peak(R_);
  const double none = cost_of_new({.max_range_m = sensor_.max_range_m});
  const JointExplanation explanation =
      most_probable_explanations(unidentified_.readings,
                                 {.none = none, .least = least, .limit = joint_limits_})
          .front();
  mark_ambiguous(explanation, none);
  decide(explanation);
}

/// Landmarks near where each observation points, made active.
void EkfSlam::find_candidates() {
  if (belief_.off_grid_m > kOffGridShare * sensor_.max_range_m) refresh_grid(belief_);
  auto& [observations, candidates, nearest, readings] = unidentified_;
  candidates.resize(observations.size());
  in_view_.clear();
  const Matrix3 of_pose = belief_.joint.body().covariance;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const SightedLandmark sighted =
        sighted_landmark(belief_.joint.pose(), sensor_.body_from_sensor, observations_[observations[k]]);
    const Matrix2 spread = sighted.by_pose * of_pose * sighted.by_pose.transpose() + sighted.spread(R_);
    const double sigma = std::sqrt(spread.trace());
    // A landmark is taken to be as uncertain as what is seen: twice the σ.
    const double radius =
        std::sqrt(options_.unknown.near * options_.unknown.gate) * 2.0 * sigma + 2.0 * belief_.off_grid_m;
    belief_.grid.near(sighted.in_world, radius, kMostShown, candidates[k]);
    in_view_.insert(in_view_.end(), candidates[k].begin(), candidates[k].end());
  }
  std::ranges::sort(in_view_);
  in_view_.erase(std::unique(in_view_.begin(), in_view_.end()), in_view_.end());
  belief_.joint.activate(in_view_);
}

/// The pairings that pass the gate alone, and the covariance of all their innovations together.
void EkfSlam::pair_candidates() {
  auto& [observations, candidates, nearest, readings] = unidentified_;
  readings.observations = observations.size();
  readings.pairings.clear();
  stacked_.H.clear();
  stacked_.matches.clear();
  nearest.assign(observations.size(), {});
  for (std::size_t k = 0; k < observations.size(); ++k)
    for (const std::size_t landmark : candidates[k]) pair(k, landmark);
  set_innovation_covariance();
  const auto rows = 2 * static_cast<Index>(stacked_.matches.size());
  readings.S = stacked_.S.topLeftCorner(rows, rows);
  readings.innovation.resize(rows);
  for (std::size_t p = 0; p < stacked_.matches.size(); ++p)
    readings.innovation.segment<2>(2 * static_cast<Index>(p)) = stacked_.matches[p].innovation;
}

/// Within the gate it may be that landmark; near it and yet not within the gate it is more often that than a
/// new one.
void EkfSlam::pair(std::size_t sighting, std::size_t landmark) {
  const std::size_t i = unidentified_.observations[sighting];
  const Index at = belief_.joint.index_of(landmark);
  const ExpectedReading expected =
      expected_reading(belief_.joint.pose(), sensor_.body_from_sensor, belief_.joint.active(at));
  const JointGaussian::Rows rows{at, expected.by_pose, expected.by_landmark};
  const Vector2 innovation = innovation_of(observations_[i], expected);
  const Matrix2 S = belief_.joint.projected_covariance(rows) + R_;
  const double nis = innovation.dot(S.inverse() * innovation);
  UnidentifiedSightings::Nearest& nearest = unidentified_.nearest[sighting];
  if (nis < nearest.nis) nearest = {innovation, nis, nearest.is_ambiguous};
  if (nis > options_.unknown.gate) {
    nearest.is_ambiguous = nearest.is_ambiguous || nis <= options_.unknown.near * options_.unknown.gate;
    return;
  }
  unidentified_.readings.pairings.push_back({sighting, landmark});
  stacked_.matches.push_back({i, landmark, innovation});
  stacked_.H.push_back(rows);
}

/// What would be a landmark that no other sighting shows, if only it went together with the rest, is no new
/// one: together even consistent sightings fail now and then, and the worst of them would create a phantom
/// that takes the next ones. One beside a landmark that another observation shows is new: both are there.
void EkfSlam::mark_ambiguous(const JointExplanation& explanation, double none) {
  const JointReadings& readings = unidentified_.readings;
  std::vector<std::size_t> shown;
  for (const int pairing : explanation.pairing)
    if (pairing >= 0) shown.push_back(readings.pairings[static_cast<std::size_t>(pairing)].landmark);
  for (std::size_t p = 0; p < readings.pairings.size(); ++p) {
    if (std::ranges::find(shown, readings.pairings[p].landmark) != shown.end()) continue;
    const auto row = 2 * static_cast<Index>(p);
    const Matrix2 S = readings.S.block<2, 2>(row, row);
    const Vector2 innovation = readings.innovation.segment<2>(row);
    const double cost = innovation.dot(S.inverse() * innovation) + cost_at_peak(S);
    if (cost < none) unidentified_.nearest[readings.pairings[p].observation].is_ambiguous = true;
  }
}

/// The matched ones, and those that are rejected; what is left is new.
void EkfSlam::decide(const JointExplanation& explanation) {
  const auto& [observations, candidates, nearest, readings] = unidentified_;
  for (std::size_t k = 0; k < observations.size(); ++k) {
    const std::size_t i = observations[k];
    const int pairing = explanation.pairing[k];
    if (pairing >= 0)
      matched_to_[i] =
          static_cast<std::int64_t>(readings.pairings[static_cast<std::size_t>(pairing)].landmark);
    else if (nearest[k].is_ambiguous)
      report_.observations[i] = {Decision::rejected, kUnknownLandmark, nearest[k].innovation, nearest[k].nis};
  }
}

/// Unidentified landmarks that ought to be seen become less likely where they are not. Eq. 23.
void EkfSlam::update_existence() {
  const std::vector<Pairing>& pairings = unidentified_.readings.pairings;
  if (unidentified_.observations.empty()) return;
  const bool has_matched = std::ranges::any_of(
      report_.observations, [](const ObservationReport& o) { return o.decision == Decision::matched; });
  const Pose2 pose = belief_.joint.pose();
  std::vector<bool> is_seen(belief_.landmarks.size(), false);
  for (const std::size_t i : unidentified_.observations) {
    if (report_.observations[i].decision == Decision::rejected) continue;
    is_seen[static_cast<std::size_t>(matched_to_[i])] = true;
    belief_.visibility.add_seen(observations_[i].range_m, observations_[i].bearing_rad);
  }
  if (!has_matched) return;
  std::vector<std::size_t> around;
  const Pose2 sensor = pose * sensor_.body_from_sensor;
  belief_.grid.near(sensor.translation(), belief_.visibility.reach_m(), belief_.landmarks.size(), around);
  std::vector<std::size_t> gone;
  for (const std::size_t landmark : around) {
    const ExpectedReading expected =
        expected_reading(pose, sensor_.body_from_sensor, belief_.grid.place(landmark));
    const bool may_have_been_seen =
        std::ranges::find(pairings, landmark, &Pairing::landmark) != pairings.end();
    const Existence::ExpectedSighting expected_sighting{
        pose.translation(), expected.range_m, expected.bearing_rad, is_seen[landmark], may_have_been_seen};
    if (!belief_.landmarks[landmark].existence.update(expected_sighting, belief_.visibility))
      gone.push_back(landmark);
  }
  std::ranges::sort(gone, std::greater<>());
  for (const std::size_t landmark : gone) remove_landmark(landmark, belief_);
}

}  // namespace trundle::slam
