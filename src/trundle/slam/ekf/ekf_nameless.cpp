// EkfSlam, where sightings have no names.
#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/slam/ekf/ekf.hpp"

namespace trundle {
namespace {

constexpr double kOffGridShare = 0.05;  // of the sensor's range: then all landmarks are put there again

}  // namespace

/// Those without names are taken for a landmark of the map that has none, or for a new one. What is neither
/// is rejected. Eq. 21, 22.
void EkfSlam::recognise() {
  nameless_.clear();
  taken_for_.assign(observations_.size(), kNone);
  for (std::size_t i = 0; i < observations_.size(); ++i)
    if (observations_[i].landmark < 0 && is_valid(observations_[i])) nameless_.push_back(i);
  if (nameless_.empty()) return;
  find_candidates();
  pair_up();
  const double least = cost_at_peak(R_);
  const double none = cost_of_new({.max_range_m = sensor_.max_range_m});
  const JointExplanation explanation =
      most_probable_explanations(readings_, {.none = none, .least = least, .limit = joint_limits_}).front();
  doubt_the_left_over(explanation, none);
  decide(explanation);
}

/// Landmarks near where each observation points, made active.
void EkfSlam::find_candidates() {
  if (off_grid_m_ > kOffGridShare * sensor_.max_range_m) locate_again();
  candidates_.resize(nameless_.size());
  seen_.clear();
  const Matrix3 of_pose = state_.body().covariance;
  for (std::size_t k = 0; k < nameless_.size(); ++k) {
    const SightedLandmark sighted =
        sighted_landmark(state_.pose(), sensor_.body_from_sensor, observations_[nameless_[k]]);
    const Matrix2 spread = sighted.by_pose * of_pose * sighted.by_pose.transpose() + sighted.spread(R_);
    const double sigma = std::sqrt(spread.trace());
    const double radius =
        std::sqrt(options_.unknown.near * options_.unknown.gate) * 2.0 * sigma + 2.0 * off_grid_m_;
    grid_.near(sighted.in_world, radius, kMostShown, candidates_[k]);
    seen_.insert(seen_.end(), candidates_[k].begin(), candidates_[k].end());
  }
  std::ranges::sort(seen_);
  seen_.erase(std::unique(seen_.begin(), seen_.end()), seen_.end());
  state_.activate(seen_);
}

/// The pairings that pass the gate alone, and the covariance of all their innovations together.
void EkfSlam::pair_up() {
  readings_.observations = nameless_.size();
  readings_.pairings.clear();
  H_.clear();
  matches_.clear();
  nearest_.assign(nameless_.size(), {});
  for (std::size_t k = 0; k < nameless_.size(); ++k)
    for (const std::size_t landmark : candidates_[k]) pair(k, landmark);
  covary();
  const auto rows = 2 * static_cast<Index>(matches_.size());
  readings_.S = S_.topLeftCorner(rows, rows);
  readings_.innovation.resize(rows);
  for (std::size_t p = 0; p < matches_.size(); ++p)
    readings_.innovation.segment<2>(2 * static_cast<Index>(p)) = matches_[p].innovation;
}

/// Within the gate it may be that landmark; near it and yet not within the gate it is more often that than a
/// new one.
void EkfSlam::pair(std::size_t nameless, std::size_t landmark) {
  const std::size_t i = nameless_[nameless];
  const Index at = state_.index_of(landmark);
  const ExpectedReading expected =
      expected_reading(state_.pose(), sensor_.body_from_sensor, state_.active(at));
  const JointGaussian::Rows rows{at, expected.by_pose, expected.by_landmark};
  const Vector2 innovation = innovation_of(observations_[i], expected);
  const Matrix2 S = state_.projected_covariance(rows) + R_;
  const double nis = innovation.dot(S.inverse() * innovation);
  Nearest& nearest = nearest_[nameless];
  if (nis < nearest.nis) nearest = {innovation, nis, nearest.is_doubtful};
  if (nis > options_.unknown.gate) {
    nearest.is_doubtful = nearest.is_doubtful || nis <= options_.unknown.near * options_.unknown.gate;
    return;
  }
  readings_.pairings.push_back({nameless, landmark});
  matches_.push_back({i, landmark, innovation});
  H_.push_back(rows);
}

/// What would be a landmark that nobody else shows, if only it went together with the rest, is no new one:
/// together even honest sightings fail now and then, and the worst of them would found a phantom that takes
/// the next ones. One of a landmark that another observation shows is new: both are there.
void EkfSlam::doubt_the_left_over(const JointExplanation& explanation, double none) {
  std::vector<std::size_t> shown;
  for (const int pairing : explanation.pairing)
    if (pairing >= 0) shown.push_back(readings_.pairings[static_cast<std::size_t>(pairing)].landmark);
  for (std::size_t p = 0; p < readings_.pairings.size(); ++p) {
    if (std::ranges::find(shown, readings_.pairings[p].landmark) != shown.end()) continue;
    const auto row = 2 * static_cast<Index>(p);
    const Matrix2 S = readings_.S.block<2, 2>(row, row);
    const Vector2 innovation = readings_.innovation.segment<2>(row);
    const double cost = innovation.dot(S.inverse() * innovation) + cost_at_peak(S);
    if (cost < none) nearest_[readings_.pairings[p].observation].is_doubtful = true;
  }
}

void EkfSlam::decide(const JointExplanation& explanation) {
  for (std::size_t k = 0; k < nameless_.size(); ++k) {
    const std::size_t i = nameless_[k];
    const int pairing = explanation.pairing[k];
    if (pairing >= 0)
      taken_for_[i] =
          static_cast<std::int64_t>(readings_.pairings[static_cast<std::size_t>(pairing)].landmark);
    else if (nearest_[k].is_doubtful)
      report_.observations[i] = {Decision::rejected, kUnknownLandmark, nearest_[k].innovation,
                                 nearest_[k].nis};
  }
}

/// Landmarks without names that ought to be seen become less likely where they are not.
void EkfSlam::look_around() {
  const bool has_matched = std::ranges::any_of(
      report_.observations, [](const ObservationReport& o) { return o.decision == Decision::matched; });
  const Pose2 pose = state_.pose();
  std::vector<bool> is_seen(entries_.size(), false);
  for (const std::size_t i : nameless_) {
    if (report_.observations[i].decision == Decision::rejected) continue;
    is_seen[static_cast<std::size_t>(taken_for_[i])] = true;
    visibility_.saw(observations_[i].range_m, observations_[i].bearing_rad);
  }
  if (!has_matched) return;
  std::vector<std::size_t> around;
  const Pose2 sensor = pose * sensor_.body_from_sensor;
  grid_.near(sensor.translation(), visibility_.reach_m(), entries_.size(), around);
  std::vector<std::size_t> gone;
  for (const std::size_t landmark : around) {
    const ExpectedReading expected = expected_reading(pose, sensor_.body_from_sensor, grid_.place(landmark));
    const bool may_have_been_seen =
        std::ranges::find(readings_.pairings, landmark, &Pairing::landmark) != readings_.pairings.end();
    const Existence::Look look{pose.translation(), expected.range_m, expected.bearing_rad, is_seen[landmark],
                               may_have_been_seen};
    if (!entries_[landmark].existence.look(look, visibility_)) gone.push_back(landmark);
  }
  std::ranges::sort(gone, std::greater<>());
  for (const std::size_t landmark : gone) remove(landmark);
}

}  // namespace trundle
