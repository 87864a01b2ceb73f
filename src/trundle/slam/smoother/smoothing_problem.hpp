#pragma once

#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "trundle/slam/motion.hpp"
#include "trundle/slam/observation.hpp"

namespace trundle {

/// A motion that also tells how it depends on parameters that are estimated with it:
/// truth = mean · exp(by_parameters · p + e), e ~ N(0, covariance).
struct FreeMotion {
  Pose2 mean;
  Matrix3 covariance = Matrix3::Zero();  ///< as of Motion
  Eigen::Matrix3Xd by_parameters;        ///< one column for each parameter
};
FreeMotion operator*(const FreeMotion& first, const FreeMotion& second);

/// The odometry between two poses.
struct MotionLink {
  int from = kKnown;
  int to = 0;
  Pose2 start = {};  ///< of a link from a pose that is known
  Pose2 mean;
  Matrix3 information = Matrix3::Identity();
  Eigen::Matrix3Xd by_parameters;

  static constexpr int kKnown = -1;
};

/// The inverse of the motion's covariance with 1 µm and 1 µrad added: a robot that stands still is as sure as
/// that.
MotionLink link_of(int from, int to, const FreeMotion& motion);

struct SightingLink {
  int pose = 0;
  int landmark = 0;
  Observation observation;
};

/// All that is known of poses, landmarks and parameters. docs/smoother.md, eq. 1-4.
struct SmoothingProblem {
  LandmarkSensor sensor;
  int poses = 0;
  int landmarks = 0;
  std::vector<MotionLink> motions;
  std::vector<SightingLink> sightings;
  Eigen::VectorXd parameter_information;  ///< prior of each parameter, about 0; 0: none
  double gate = 0.0;                      ///< NIS beyond which a sighting pulls less than its square says
};

/// Values of the unknowns.
struct SmoothingState {
  std::vector<Pose2> poses;
  std::vector<Vector2> landmarks;
  Eigen::VectorXd parameters;
};

/// e = Log(mean⁻¹ a⁻¹ b) − S p and its derivatives by moves a · exp(δ), b · exp(δ); that by p is −S. Eq.
/// 1, 5.
struct MotionResidual {
  Vector3 error;
  Matrix3 by_from;
  Matrix3 by_to;
};
MotionResidual motion_residual(const MotionLink& link, const Pose2& from, const Pose2& to,
                               const Eigen::VectorXd& parameters);

/// Reading minus expectation over its sigmas, and derivatives by a move pose · exp(δ) and by the landmark.
/// Eq. 2, 6.
struct SightingResidual {
  Vector2 error;
  Matrix23 by_pose;
  Matrix2 by_landmark;
};
SightingResidual sighting_residual(const LandmarkSensor& sensor, const Observation& observation,
                                   const Pose2& pose, const Vector2& landmark);

/// What a squared residual counts for: itself up to the gate, then its logarithm; and the derivative. Eq. 3.
inline double robust_cost(double squared, double gate) {
  return squared <= gate ? squared : gate * (1.0 + std::log(squared / gate));
}
inline double robust_weight(double squared, double gate) {
  return squared <= gate ? 1.0 : gate / squared;
}

/// Eq. 4.
double cost_of(const SmoothingProblem& problem, const SmoothingState& state);

}  // namespace trundle
