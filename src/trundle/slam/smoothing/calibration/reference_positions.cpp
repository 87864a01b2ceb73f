#include "trundle/slam/smoothing/calibration/reference_positions.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "trundle/geometry/rigid_motion.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::slam {
namespace {

constexpr double kLeastSpacing_s = 1.0;  // body wobble and tracking err alike for as long
// Bounds the time that a long recording takes: its positions lie farther apart.
constexpr double kMostPositions = 400.0;
// No reference sees a point of the body better than that [m]: bodies wobble, stamps jitter. Where motions are
// much noisier than positions, nothing shows by how little these err.
constexpr double kLeastPositionSigma_m = 1e-3;

/// The point that the reference sees; nothing where it does not.
std::optional<Vector2> position_at(const Run& run, const Robot& robot, double time_s) {
  const calibration::ReferenceSample sample =
      calibration::sample_reference(run.reference, time_s - robot.reference_time_offset_s);
  if (!sample.has_position()) return std::nullopt;
  return Vector2(sample.value.head<2>());
}

/// Where a path has that point, and where the reference does.
std::vector<PointPair> pairs_of(const Run& run, const Trajectory& path, const Robot& robot) {
  std::vector<PointPair> pairs;
  for (const StampedPose& stamped : path.poses)
    if (const auto position = position_at(run, robot, stamped.time_s))
      pairs.push_back({stamped.pose * robot.body_from_reference.translation(), *position});
  return pairs;
}

}  // namespace

std::optional<Pose2> start_by_reference(const Run& run, const Trajectory& path, const Robot& robot) {
  return rigid_motion(pairs_of(run, path, robot));
}

double rough_position_sigma(std::span<const AssociatedRecording> all, const Robot& robot) {
  double sum = 0.0, count = 0.0;
  for (const AssociatedRecording& one : all) {
    if (!one.in_reference) continue;
    for (const PointPair& pair : pairs_of(one.run, one.path, robot)) {
      sum += 0.5 * (pair.to - pair.from).squaredNorm();
      count += 1.0;
    }
  }
  return std::max(std::sqrt(sum / std::max(count, 1.0)), kLeastPositionSigma_m);
}

void add_positions(const Run& run, const Track& track, const Robot& robot, double sigma_m,
                   SmoothingProblem& problem) {
  if (track.keyframes() == 0) return;
  const double duration_s = track.time_of(track.keyframes() - 1) - track.time_of(0);
  const double spacing_s = std::max(kLeastSpacing_s, duration_s / kMostPositions);
  double next_s = track.time_of(0);
  for (std::size_t k = 0; k < track.keyframes(); ++k) {
    const double time_s = track.time_of(k);
    if (time_s < next_s) continue;
    const auto position = position_at(run, robot, time_s);
    if (!position) continue;
    problem.positions.push_back({.pose = track.first_pose() + static_cast<int>(k),
                                 .position = *position,
                                 .on_body = robot.body_from_reference.translation(),
                                 .sigma_m = sigma_m});
    next_s = time_s + spacing_s;
  }
}

// Förstner's estimator: what is left, over what the unknowns leave of each.
double position_sigma(const SmoothingProblem& problem, const SmoothingState& state,
                      const Minimiser& linearised) {
  double squares = 0.0, left = 0.0;
  for (const PositionLink& link : problem.positions) {
    const PositionResidual r = position_residual(link, state);
    const double weight = robust_weight(r.error.squaredNorm(), problem.gate);
    const Matrix3 P = linearised.pose_covariance(link.pose).topLeftCorner<3, 3>();
    squares += weight * r.error.squaredNorm() * squared(link.sigma_m);
    left += 2.0 - weight * (r.by_pose * P * r.by_pose.transpose()).trace();
  }
  return std::max(std::sqrt(squares / std::max(left, 1.0)), kLeastPositionSigma_m);
}

}  // namespace trundle::slam
