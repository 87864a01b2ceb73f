#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "trundle/calibration/problem/bias_walk.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {

/// What of a run's motion is its own, and no parameter of a robot.
struct OwnMotion {
  /// Where it is given, the harmonics of Run::gyro_walk: the place of the gyro's bias among the parameters.
  std::optional<std::size_t> walking_bias = {};
  bool start_heading = false;  ///< behind the harmonics
};

/// How the pose depends on what is the run's own: on the heading at its start as on any error of heading
/// there; on the harmonics by which the gyro's bias walks as on the bias, times what each harmonic is at the
/// time. Its columns stand behind those of the parameters. docs/theory/calibration-runs.md, eq. 6d and 6e.
class OwnSensitivity {
 public:
  /// Walks that outlive it.
  OwnSensitivity(const BiasWalk& walk, const OwnMotion& own) : walk_(walk), own_(own) {}

  [[nodiscard]] Eigen::Index columns() const { return harmonics() + (own_.start_heading ? 1 : 0); }
  /// Where an odometer stands that owes nothing to the run's own yet.
  void begin(const Odometer& odometer, double time_s);
  /// At the run's start, where the reference shows the position of a place on the robot (`lever`: from the
  /// body's origin, in world axes) about which the heading turns it.
  void begin_at_start(const Odometer& odometer, double time_s, const Vector2& lever);
  /// To where it has come since without being corrected.
  void advance(const Odometer& odometer, double time_s);
  /// What an innovation has corrected: pose += K (innovation − J · own).
  void correct(const Eigen::Matrix3Xd& KJ, const Odometer& odometer);
  /// ∂(x, y, heading)/∂own in world axes.
  [[nodiscard]] const Eigen::Matrix3Xd& of_pose() const { return of_pose_; }
  /// A Jacobian of what readings of that time say without a pose, with the own columns.
  [[nodiscard]] Eigen::MatrixXd extended(const Eigen::MatrixXd& by_parameters, double time_s) const;

 private:
  [[nodiscard]] Eigen::Index harmonics() const { return own_.walking_bias ? walk_.harmonics : 0; }
  void mark(const Odometer& odometer);

  const BiasWalk& walk_;
  OwnMotion own_;
  Eigen::Matrix3Xd of_pose_;
  Pose2 from_;
  Vector3 by_bias_ = Vector3::Zero();
  double time_s_ = 0.0;
};

}  // namespace trundle::calibration
