#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "trundle/calibration/problem/bias_walk.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {

/// How what was measured depends on the harmonics by which the gyro's bias walks over a run: at any time as
/// on the bias, times what each harmonic is then. Its columns stand behind those of the parameters.
/// docs/theory/calibration-runs.md, eq. 6d.
class WalkSensitivity {
 public:
  /// `bias`: the place of the gyro's bias among the parameters of the odometer. Walks that outlive it.
  WalkSensitivity(const BiasWalk& walk, std::size_t bias) : walk_(walk), bias_(bias) {}

  [[nodiscard]] Eigen::Index harmonics() const { return walk_.harmonics; }
  /// From where an odometer stands that owes nothing to a walk yet.
  void begin(const Odometer& odometer, double time_s);
  /// To where it has come since without being corrected.
  void advance(const Odometer& odometer, double time_s);
  /// What an innovation has corrected: pose += K (innovation − J · harmonics).
  void correct(const Eigen::Matrix3Xd& KJ, const Odometer& odometer);
  /// ∂(x, y, heading)/∂harmonics in world axes.
  [[nodiscard]] const Eigen::Matrix3Xd& of_pose() const { return of_pose_; }
  /// A Jacobian of something that was read at that time, with the harmonics' columns.
  [[nodiscard]] Eigen::MatrixXd extended(const Eigen::MatrixXd& by_parameters, double time_s) const;

 private:
  void mark(const Odometer& odometer);

  const BiasWalk& walk_;
  std::size_t bias_;
  Eigen::Matrix3Xd of_pose_;
  Pose2 from_;
  Vector3 by_bias_ = Vector3::Zero();
  double time_s_ = 0.0;
};

}  // namespace trundle::calibration
