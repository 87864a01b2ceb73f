#include "trundle/slam/smoothing/calibration/lasting_errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trundle/slam/nth.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
namespace {

// Beyond it a correlation is no chance: three of its sigmas, 1/√n.
constexpr double kChanceSigmas = 3.0;
// The correlation with which a mean of many is √1.5 = 1.2 times as uncertain. Less is within what sigmas are
// known to.
constexpr double kLeastCorrelation = 0.2;
// In sigmas: an outlier tells nothing of its neighbours.
constexpr double kMostError = 3.0;

/// Errors in their sigmas, one after the other.
class Autocorrelation {
 public:
  explicit Autocorrelation(std::string of) : of_(std::move(of)) {}

  void add(double before, double error, double spacing_s) {
    error = std::clamp(error, -kMostError, kMostError);
    const double other = std::clamp(before, -kMostError, kMostError);
    lagged_ += other * error;
    own_ += 0.5 * (other * other + error * error);
    spacing_s_.push_back(spacing_s);
  }

  void report(std::vector<LastingError>& errors) {
    if (spacing_s_.empty() || !(own_ > 0.0)) return;
    const double correlation = lagged_ / own_;
    const double chance = kChanceSigmas / std::sqrt(static_cast<double>(spacing_s_.size()));
    if (correlation > std::max(chance, kLeastCorrelation))
      errors.push_back({of_, correlation, median(std::move(spacing_s_))});
  }

 private:
  std::string of_;
  double lagged_ = 0.0, own_ = 0.0;
  std::vector<double> spacing_s_;
};

/// By pose of the problem [s].
std::vector<double> stamps_of(const JointProblem& joint) {
  std::vector<double> stamps;
  for (const Track& track : joint.tracks)
    for (std::size_t k = 0; k < track.keyframes(); ++k) stamps.push_back(track.time_of(k));
  return stamps;
}

struct SightingError {
  Vector2 error = Vector2::Zero();
  double time_s = std::numeric_limits<double>::quiet_NaN();  ///< NaN: there is none
};

}  // namespace

double LastingError::of_means() const {
  return std::sqrt((1.0 + correlation) / (1.0 - correlation));
}

std::vector<LastingError> lasting_errors(const JointProblem& joint, const SmoothingState& state) {
  const std::vector<double> stamps = stamps_of(joint);
  Autocorrelation ranges("ranges"), bearings("bearings"), travel("travel"), turns("turns"),
      positions("positions of the reference");
  std::vector<SightingError> last(state.landmarks.size());
  for (const SightingLink& link : joint.problem.sightings) {
    const auto pose = nth(link.pose);
    SightingError& before = last[nth(link.landmark)];
    const SightingError now{sighting_residual(joint.problem, link, state).error, stamps[pose]};
    if (!std::isnan(before.time_s)) {
      ranges.add(before.error.x(), now.error.x(), now.time_s - before.time_s);
      bearings.add(before.error.y(), now.error.y(), now.time_s - before.time_s);
    }
    before = now;
  }
  Vector3 moved = Vector3::Zero();  // before, unless a track begins
  bool begins = true;
  for (const MotionLink& link : joint.problem.motions) {
    if (link.from == MotionLink::kKnown) {
      begins = true;
      continue;
    }
    const Vector3 error = motion_residual(link, state)
                              .error.head<3>()
                              .cwiseProduct(link.information.diagonal().head<3>().cwiseSqrt());
    const double spacing_s = stamps[nth(link.to)] - stamps[nth(link.from)];
    if (!begins) {
      travel.add(moved.x(), error.x(), spacing_s);
      turns.add(moved.z(), error.z(), spacing_s);
    }
    moved = error;
    begins = false;
  }
  const auto track_of = [&](int pose) {
    return std::ranges::count_if(joint.tracks,
                                 [&](const Track& track) { return track.first_pose() <= pose; });
  };
  for (std::size_t i = 1; i < joint.problem.positions.size(); ++i) {
    const PositionLink &before = joint.problem.positions[i - 1], &now = joint.problem.positions[i];
    if (track_of(before.pose) != track_of(now.pose)) continue;
    const double spacing_s = stamps[nth(now.pose)] - stamps[nth(before.pose)];
    const Vector2 was = position_residual(before, state).error, is = position_residual(now, state).error;
    for (const int axis : {0, 1}) positions.add(was[axis], is[axis], spacing_s);
  }
  std::vector<LastingError> errors;
  for (Autocorrelation* errors_of_one : {&ranges, &bearings, &travel, &turns, &positions})
    errors_of_one->report(errors);
  return errors;
}

}  // namespace trundle::slam
