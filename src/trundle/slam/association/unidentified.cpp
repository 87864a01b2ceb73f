#include "trundle/slam/association/unidentified.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace trundle::slam {
namespace {

using Eigen::Index;

// Sightings whose joint gate is computed beforehand; more of them have that of so many, which is too strict.
constexpr std::size_t kMostTogether = 64;

}  // namespace

UnidentifiedSightings::UnidentifiedSightings(const LandmarkSensor& sensor, double gate)
    : sensor_(sensor),
      options_{.max_range_m = sensor.max_range_m},
      joint_limits_(joint_limits(gate, kMostTogether)),
      least_(cost_at_peak(reading_covariance(sensor))),
      none_(cost_of_new(options_)) {}

void UnidentifiedSightings::begin(std::span<const Observation> observations) {
  all_ = observations;
  shown_.assign(observations.size(), kNone);
  observations_.clear();
  for (std::size_t i = 0; i < observations.size(); ++i)
    if (observations[i].landmark < 0 && is_valid(observations[i])) observations_.push_back(i);
  nearest_.assign(observations_.size(), {});
  readings_.observations = observations_.size();
  readings_.pairings.clear();
}

/// A landmark is taken to be as uncertain as what is seen: twice the σ.
std::vector<std::vector<std::size_t>> UnidentifiedSightings::candidates(const PoseEstimate& body,
                                                                        const LandmarkGrid& grid,
                                                                        double moved_m) const {
  const Matrix2 R = reading_covariance(sensor_);
  std::vector<std::vector<std::size_t>> near(observations_.size());
  for (std::size_t k = 0; k < observations_.size(); ++k) {
    const SightedLandmark sighted =
        sighted_landmark(body.pose, sensor_.body_from_sensor, all_[observations_[k]]);
    const Matrix2 spread =
        sighted.by_pose * body.covariance * sighted.by_pose.transpose() + sighted.spread(R);
    const double radius = std::sqrt(options_.near * options_.gate) * 2.0 * std::sqrt(spread.trace());
    grid.near(sighted.in_world, radius + moved_m, kMostShown, near[k]);
  }
  return near;
}

/// Near a landmark and yet not within its gate it is more often that one than a new one.
bool UnidentifiedSightings::consider(std::size_t k, std::size_t landmark, const Vector2& innovation,
                                     const Matrix2& S) {
  const double nis = innovation.dot(S.inverse() * innovation);
  Nearest& nearest = nearest_[k];
  if (nis < nearest.nis) nearest = {innovation, nis, nearest.is_ambiguous};
  if (nis <= options_.gate) {
    readings_.pairings.push_back({k, landmark});
    return true;
  }
  nearest.is_ambiguous = nearest.is_ambiguous || nis <= options_.near * options_.gate;
  return false;
}

void UnidentifiedSightings::decide(Eigen::VectorXd innovation, Eigen::MatrixXd S, StepReport& report) {
  readings_.innovation = std::move(innovation);
  readings_.S = std::move(S);
  const JointExplanation explanation =
      most_probable_explanations(readings_, {.none = none_, .least = least_, .limit = joint_limits_}).front();
  mark_ambiguous(explanation);
  for (std::size_t k = 0; k < observations_.size(); ++k) {
    const int pairing = explanation.pairing[k];
    if (pairing >= 0)
      show(observations_[k], readings_.pairings[static_cast<std::size_t>(pairing)].landmark);
    else if (nearest_[k].is_ambiguous)
      report.observations[observations_[k]] = {Decision::rejected, kUnknownLandmark, nearest_[k].innovation,
                                               nearest_[k].nis};
  }
}

/// What would be a landmark that no other sighting shows, if only it went together with the rest, is no new
/// one: together even consistent sightings fail now and then, and the worst of them would create a phantom
/// that takes the next ones. One beside a landmark that another observation shows is new: both are there.
void UnidentifiedSightings::mark_ambiguous(const JointExplanation& explanation) {
  std::vector<std::size_t> shown;
  for (const int pairing : explanation.pairing)
    if (pairing >= 0) shown.push_back(readings_.pairings[static_cast<std::size_t>(pairing)].landmark);
  for (std::size_t p = 0; p < readings_.pairings.size(); ++p) {
    if (std::ranges::find(shown, readings_.pairings[p].landmark) != shown.end()) continue;
    const auto row = 2 * static_cast<Index>(p);
    const Matrix2 S = readings_.S.block<2, 2>(row, row);
    const Vector2 innovation = readings_.innovation.segment<2>(row);
    const double cost = innovation.dot(S.inverse() * innovation) + cost_at_peak(S);
    if (cost < none_) nearest_[readings_.pairings[p].observation].is_ambiguous = true;
  }
}

std::vector<std::size_t> UnidentifiedSightings::update_existence(
    const Pose2& pose, const StepReport& report, const LandmarkGrid& grid, Visibility& visibility,
    const std::function<Existence&(std::size_t)>& existence) const {
  if (observations_.empty()) return {};
  const auto decision = [](const ObservationReport& o) { return o.decision; };
  std::vector<std::size_t> seen;
  for (const std::size_t i : observations_) {
    if (report.observations[i].decision == Decision::rejected) continue;
    seen.push_back(static_cast<std::size_t>(shown_[i]));
    visibility.add_seen(all_[i].range_m, all_[i].bearing_rad);
  }
  if (std::ranges::find(report.observations, Decision::matched, decision) == report.observations.end())
    return {};
  std::vector<std::size_t> around;
  grid.near((pose * sensor_.body_from_sensor).translation(), visibility.reach_m(),
            std::numeric_limits<std::size_t>::max(), around);
  std::vector<std::size_t> gone;
  for (const std::size_t landmark : around) {
    const ExpectedReading expected = expected_reading(pose, sensor_.body_from_sensor, grid.place(landmark));
    const bool is_seen = std::ranges::find(seen, landmark) != seen.end();
    const bool may_have_been_seen =
        std::ranges::find(readings_.pairings, landmark, &Pairing::landmark) != readings_.pairings.end();
    if (!existence(landmark).update(
            {pose.translation(), expected.range_m, expected.bearing_rad, is_seen, may_have_been_seen},
            visibility))
      gone.push_back(landmark);
  }
  std::ranges::sort(gone, std::greater<>());
  return gone;
}

}  // namespace trundle::slam
