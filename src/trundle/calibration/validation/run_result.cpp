#include "trundle/calibration/validation/run_result.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/calibration/problem/run_clock.hpp"
#include "trundle/calibration/problem/run_gyro_bias.hpp"
#include "trundle/evaluation/evaluate.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/odometry/uncertain.hpp"

namespace trundle::calibration {
namespace {

// More than a picture has pixels across.
constexpr std::size_t kPosesInPictures = 1500;
// A run is closed when it ends within this part of its path from its start, having turned about a full turn
// or more, always the same way.
constexpr double kClosed = 0.1;

/// The reference where the body is, in the frame of the body's first pose, at its own stamps.
Trajectory reference_of_body(const Run& run, const Robot& robot) {
  Trajectory trajectory;
  const Pose2 reference_from_body = robot.body_from_reference.inverse();
  double heading = 0.0;
  for (std::size_t i = 0; i < run.reference.time_s.size(); ++i) {
    if (run.reference.x_m.empty() || run.reference.y_m.empty()) break;
    const double x = run.reference.x_m[i];
    const double y = run.reference.y_m[i];
    const double h = run.reference.heading_rad.empty() ? kNotMeasured : run.reference.heading_rad[i];
    if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(h)) continue;
    heading = unwrap_angle(h, heading);
    trajectory.poses.push_back({run.reference.time_s[i] + robot.reference_time_offset_s,
                                Pose2{x, y, heading} * reference_from_body});
  }
  if (trajectory.poses.empty()) return trajectory;
  const Pose2 start_from_world = trajectory.poses.front().pose.inverse();
  for (StampedPose& stamped : trajectory.poses) stamped.pose = start_from_world * stamped.pose;
  return trajectory;
}

/// Which poses of a run's odometry are looked at: beside the reference's stamps, and those that are drawn.
struct PosesLookedAt {
  std::vector<bool> about_reference;
  std::size_t every;  ///< of all poses one in so many is drawn

  PosesLookedAt(const Run& run, const Robot& robot)
      : about_reference(poses_about_reference(run, robot)),
        every(about_reference.size() / kPosesInPictures + 1) {}

  bool is_drawn(std::size_t pose) const { return pose % every == 0; }
  bool is_kept(std::size_t pose) const { return about_reference[pose] || is_drawn(pose); }
  /// Of those that were kept.
  Trajectory drawn(const Trajectory& kept) const {
    Trajectory picture;
    auto next = kept.poses.begin();
    for (std::size_t pose = 0; pose < about_reference.size(); ++pose) {
      if (!is_kept(pose)) continue;
      if (is_drawn(pose)) picture.poses.push_back(*next);
      ++next;
    }
    return picture;
  }
};

/// Odometry from the reference's first pose on, in that pose's frame.
IntegratedOdometry odometry_from_start(const Run& run, const Robot& robot, const ReferenceNoise& noise,
                                       const PosesLookedAt& poses, bool learn_gyro_bias) {
  const Vector3 sigma = noise.sigma();
  IntegrateOptions options{.start_covariance = sigma.cwiseAbs2().asDiagonal(),
                           .learn_gyro_bias = learn_gyro_bias,
                           .keep_white_covariances = true};
  options.keeps = [&](std::size_t pose) { return poses.is_kept(pose); };
  return integrate(run.readings, robot, options);
}

/// The robot as it was in a run whose own gyro bias is known apart from that of others.
Robot in_run(Robot robot, const std::optional<GyroBias>& own) {
  if (!own || !robot.calibration) return robot;
  const auto& parameters = robot.calibration->parameters;
  const auto at = std::ranges::find(parameters, name_of(kGyroBias, robot), &CalibratedParameter::name) -
                  parameters.begin();
  Eigen::MatrixXd& covariance = robot.calibration->covariance;
  if (at >= covariance.rows()) return robot;
  covariance.row(at).setZero();
  covariance.col(at).setZero();
  covariance(at, at) = own->variance;
  return robot;
}

TrajectoryError error_of(const Trajectory& odometry, const Trajectory& reference) {
  const Evaluation e = evaluate(odometry, reference, {.alignment = Alignment::start, .distances_m = {}});
  const PosePair first = common_poses(odometry, reference, 0.5).front();
  const PosePair last = common_poses(odometry, reference, 0.5).back();
  const Pose2 seen = first.reference.inverse() * last.reference;
  const Pose2 driven = first.estimate.inverse() * last.estimate;
  return {.position_rms_m = e.position_m.rms,
          .position_max_m = e.position_m.max,
          .heading_rms_rad = e.heading_rms_rad.value_or(0.0),
          .end_x_m = seen.x - driven.x,
          .end_y_m = seen.y - driven.y,
          .end_heading_rad = wrap_angle(seen.heading - driven.heading),
          .path_m = e.path_m};
}

double mean_nees(const Trajectory& odometry, const std::vector<Matrix3>& covariances,
                 const Trajectory& reference, const ReferenceNoise& noise) {
  Trajectory with_covariance = odometry;
  const Vector3 variance = noise.sigma().cwiseAbs2();
  for (std::size_t i = 0; i < covariances.size(); ++i) {
    with_covariance.covariances[i] = covariances[i];
    with_covariance.covariances[i].diagonal() += variance;
  }
  double sum = 0.0;
  int count = 0;
  for (const PosePair& pair : common_poses(with_covariance, reference, 0.5)) {
    const Vector3 error(pair.reference.x - pair.estimate.x, pair.reference.y - pair.estimate.y,
                        wrap_angle(pair.reference.heading - pair.estimate.heading));
    sum += error.dot(pair.covariance->inverse() * error);
    ++count;
  }
  return sum / std::max(count, 1);
}

/// Squares and circles do, tours that happen to end near their start do not. `sense`: 1 counter-clockwise,
/// −1.
bool turns_one_way(const Trajectory& trajectory, double sense) {
  constexpr double kTurnedBack = kPi / 4.0;
  double furthest = sense * trajectory.poses.front().pose.heading;
  for (const StampedPose& stamped : trajectory.poses) {
    const double heading = sense * stamped.pose.heading;
    if (heading < furthest - kTurnedBack) return false;
    furthest = std::max(furthest, heading);
  }
  return true;
}

std::string turn_of(const Trajectory& reference) {
  const std::vector<double> paths = path_lengths(reference);
  const Pose2& first = reference.poses.front().pose;
  const Pose2& last = reference.poses.back().pose;
  const double turned = last.heading - first.heading;
  const double apart = std::hypot(last.x - first.x, last.y - first.y);
  if (std::abs(turned) < 1.5 * kPi || apart > kClosed * paths.back()) return "";
  if (!turns_one_way(reference, turned > 0.0 ? 1.0 : -1.0)) return "";
  return turned > 0.0 ? "ccw" : "cw";
}

struct Centre {
  Vector2 sum = Vector2::Zero();
  int count = 0;

  void add(const TrajectoryError& error) {
    sum += Vector2(error.end_x_m, error.end_y_m);
    ++count;
  }
  double distance() const { return sum.norm() / count; }
};

}  // namespace

RunResult run_result(const Run& run, const Robot& nominal, const Robot& calibrated,
                     const ReferenceNoise& noise, const RunUse& use) {
  RunResult result;
  result.name = run.name;
  result.session = run.session;
  result.hold_out = use.hold_out;
  result.gyro_bias = use.gyro_bias;
  result.reference_clock = clock_of(run);
  const Trajectory reference = reference_of_body(run, calibrated);
  if (reference.poses.size() < 2) return result;
  const PosesLookedAt poses(run, calibrated);  // by whose clock the reference is
  const bool learns = use.hold_out && run.shows_gyro_bias();
  const IntegratedOdometry before = odometry_from_start(as_recorded(run), nominal, noise, poses, learns);
  const IntegratedOdometry after =
      odometry_from_start(run, in_run(calibrated, use.gyro_bias), noise, poses, learns);
  try {
    result.before = error_of(before.trajectory, reference);
    result.after = error_of(after.trajectory, reference);
  } catch (const CannotAnswer& reason) {
    result.remark = reason.what();
    return result;
  }
  const double since = common_poses(after.trajectory, reference, 0.5).front().time_s;
  if (since - run.readings.start_s < 1.0) {
    result.nees = mean_nees(after.trajectory, after.trajectory.covariances, reference, noise);
    result.nees_white_only = mean_nees(after.trajectory, after.white_covariances, reference, noise);
  }
  result.turn = turn_of(reference);
  result.nominal = poses.drawn(before.trajectory);
  result.calibrated = poses.drawn(after.trajectory);
  result.reference = thinned(reference, kPosesInPictures);
  return result;
}

std::vector<ErrorBeforeAfter> errors_of(const std::vector<RunResult>& runs, bool hold_out) {
  double before = 0.0, after = 0.0, worst_before = 0.0, worst_after = 0.0;
  int count = 0;
  for (const RunResult& run : runs) {
    if (run.hold_out != hold_out || !run.before || !run.after) continue;
    before += run.before->position_rms_m * run.before->position_rms_m;
    after += run.after->position_rms_m * run.after->position_rms_m;
    worst_before = std::max(worst_before, run.before->position_max_m);
    worst_after = std::max(worst_after, run.after->position_max_m);
    ++count;
  }
  if (count == 0) return {};
  const std::string set = hold_out ? "hold-out" : "training";
  return {{set + " position rms (reprocessed)", std::sqrt(before / count), std::sqrt(after / count), "m"},
          {set + " position worst (reprocessed)", worst_before, worst_after, "m"}};
}

std::optional<MaximumError> maximum_error_of(const std::vector<RunResult>& runs) {
  Centre cw_before, cw_after, ccw_before, ccw_after;
  for (const RunResult& run : runs) {
    if (run.hold_out || !run.before || run.turn.empty()) continue;
    (run.turn == "cw" ? cw_before : ccw_before).add(*run.before);
    (run.turn == "cw" ? cw_after : ccw_after).add(*run.after);
  }
  if (cw_before.count == 0 || ccw_before.count == 0) return std::nullopt;
  return MaximumError{std::max(cw_before.distance(), ccw_before.distance()),
                      std::max(cw_after.distance(), ccw_after.distance())};
}

}  // namespace trundle::calibration
