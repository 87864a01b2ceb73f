#include "trundle/slam/smoother/smoothing_problem.hpp"

#include <Eigen/LU>

namespace trundle {
namespace {

constexpr double kLeastSigma = 1e-6;  // [m], [rad]

Matrix3 body_to_world(const Pose2& pose) {
  Matrix3 R = Matrix3::Identity();
  R.topLeftCorner<2, 2>() = rotation(pose.heading);
  return R;
}

}  // namespace

FreeMotion operator*(const FreeMotion& first, const FreeMotion& second) {
  const Matrix3 Ad = adjoint(second.mean.inverse());
  return {first.mean * second.mean, Ad * first.covariance * Ad.transpose() + second.covariance,
          Ad * first.by_parameters + second.by_parameters};
}

MotionLink link_of(int from, int to, const FreeMotion& motion) {
  const Matrix3 Q = motion.covariance + Matrix3::Identity() * (kLeastSigma * kLeastSigma);
  return {.from = from,
          .to = to,
          .mean = motion.mean,
          .information = Q.inverse(),
          .by_parameters = motion.by_parameters};
}

// Eq. 1, 5.
MotionResidual motion_residual(const MotionLink& link, const Pose2& from, const Pose2& to,
                               const Eigen::VectorXd& parameters) {
  const Twist2 xi = log(link.mean.inverse() * (from.inverse() * to));
  MotionResidual residual;
  residual.error = xi.vector() - link.by_parameters * parameters;
  residual.by_to = right_jacobian_inverse(xi);
  residual.by_from = -residual.by_to * adjoint(to.inverse() * from);
  return residual;
}

// Eq. 2, 6.
SightingResidual sighting_residual(const LandmarkSensor& sensor, const Observation& observation,
                                   const Pose2& pose, const Vector2& landmark) {
  const Vector2 root_information(1.0 / sensor.range_sigma_m, 1.0 / sensor.bearing_sigma_rad);
  const ExpectedReading expected = expected_reading(pose, sensor.body_from_sensor, landmark);
  SightingResidual residual;
  residual.error = root_information.cwiseProduct(innovation_of(observation, expected));
  residual.by_pose = -(root_information.asDiagonal() * expected.by_pose * body_to_world(pose));
  residual.by_landmark = -(root_information.asDiagonal() * expected.by_landmark);
  return residual;
}

double cost_of(const SmoothingProblem& problem, const SmoothingState& state) {
  double cost = state.parameters.cwiseAbs2().dot(problem.parameter_information);
  for (const MotionLink& link : problem.motions) {
    const Pose2& from =
        link.from == MotionLink::kKnown ? link.start : state.poses[static_cast<std::size_t>(link.from)];
    const Twist2 xi =
        log(link.mean.inverse() * (from.inverse() * state.poses[static_cast<std::size_t>(link.to)]));
    const Vector3 error = xi.vector() - link.by_parameters * state.parameters;
    cost += error.dot(link.information * error);
  }
  for (const SightingLink& link : problem.sightings)
    cost += robust_cost(
        sighting_residual(problem.sensor, link.observation, state.poses[static_cast<std::size_t>(link.pose)],
                          state.landmarks[static_cast<std::size_t>(link.landmark)])
            .error.squaredNorm(),
        problem.gate);
  return cost;
}

}  // namespace trundle
