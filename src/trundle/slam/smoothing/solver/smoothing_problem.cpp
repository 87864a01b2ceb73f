#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/slam/nth.hpp"

namespace trundle::slam {
namespace {

using calibration::ReadingErrors;

// Noise that is exactly none would make information infinite: no step is known better than to a micrometre or
// microradian, and no bias walks by less than that over a thousand seconds.
constexpr double kLeastSigma = 1e-6;  // [m], [rad]
constexpr double kLeastWalk = 1e-9;   // [rad/s]

/// Of (e, w), with what a robot is never surer of.
Eigen::Matrix4d information_of(const FreeMotion& motion) {
  Eigen::Matrix4d Q = Eigen::Matrix4d::Zero();
  Q.topLeftCorner<3, 3>() = motion.covariance + Matrix3::Identity() * (kLeastSigma * kLeastSigma);
  if (motion.by_bias.isZero(0.0) && motion.walk == 0.0) {  // there is no bias, or nothing goes with it
    Q.topLeftCorner<3, 3>() = Q.topLeftCorner<3, 3>().inverse().eval();
    Q(3, 3) = 1.0 / (kLeastWalk * kLeastWalk);
    return Q;
  }
  Q.topRightCorner<3, 1>() = motion.with_walk;
  Q.bottomLeftCorner<1, 3>() = motion.with_walk.transpose();
  Q(3, 3) = motion.walk + kLeastWalk * kLeastWalk;
  return Q.inverse();
}

/// Of two motions, the first one's carried to the end.
ReadingErrors composed(const Matrix3& Ad, const ReadingErrors& first, ReadingErrors second) {
  if (first.covariance.cols() == 0) return second;
  const ReadingErrors carried = first.mapped(Ad);
  second.sensitivity += carried.sensitivity;
  second.covariance += carried.covariance;
  second.scatter += carried.scatter;
  return second;
}

/// By how many times as much a variance that goes with a way changes where the way does by a share x. Beyond
/// −1 it goes back as far; about there it is not none, since x is not that certain.
double times_as_much(double x) {
  if (x < -1.0) return -0.5 - x;
  return x < 0.0 ? 1.0 / (1.0 - x) : 1.0 + x;
}

/// Q + change to first order, but a covariance however large the change is, along each of its axes.
Matrix3 changed_by(const Matrix3& change, const Matrix3& Q) {
  const Eigen::LLT<Matrix3> root(Q);
  if (root.info() != Eigen::Success) return Q;
  const Matrix3 half = root.matrixL().solve(change).transpose();
  const auto [by, axes] = symmetric_eigen(Matrix3(root.matrixL().solve(half)));
  const Vector3 times = by.unaryExpr(&times_as_much);
  const Matrix3 scaled = root.matrixL() * axes;
  return scaled * times.asDiagonal() * scaled.transpose();
}

/// (e, w) of eq. 1, ξ = Log(mean⁻¹ a⁻¹ b).
Eigen::Vector4d motion_error(const MotionLink& link, double start_bias, const Twist2& xi,
                             const SmoothingState& state) {
  Eigen::Vector4d error;
  error << xi.vector() - link.by_parameters * state.parameters - link.by_bias * start_bias + link.included,
      state.bias_at(link.to) - start_bias;
  return error;
}

/// A change, or as much of it as is no larger than what is changed: where a robot hardly moves, what its
/// readings err by is all there is of a sensitivity, and passes for information.
Vector3 no_larger_than(const Vector3& changed, const Vector3& change, const Matrix3& W) {
  const double most = changed.dot(W * changed), size = change.dot(W * change);
  return size > most ? std::sqrt(most / size) * change : change;
}

/// What a sensor errs by.
SensorErrors errors_of(int sensor, const SmoothingProblem& problem, const SmoothingState& state) {
  if (problem.sensor_errors.empty()) return SensorErrors::Zero();
  return problem.sensor_errors[nth(sensor)] * state.parameters;
}

}  // namespace

FreeMotion operator*(const FreeMotion& first, const FreeMotion& second) {
  const Matrix3 Ad = adjoint(second.mean.inverse());
  const Vector3 carried = Ad * first.with_walk;
  const Matrix3 mixed = carried * second.by_bias.transpose();
  FreeMotion both{first.mean * second.mean, Ad * first.covariance * Ad.transpose() + second.covariance,
                  Ad * first.by_parameters + second.by_parameters};
  both.by_bias = Ad * first.by_bias + second.by_bias;
  both.covariance += mixed + mixed.transpose() + first.walk * second.by_bias * second.by_bias.transpose();
  both.walk = first.walk + second.walk;
  both.reading_errors = composed(Ad, first.reading_errors, second.reading_errors);
  both.with_walk = carried + first.walk * second.by_bias + second.with_walk;
  return both;
}

MotionLink link_of(int from, int to, const FreeMotion& motion) {
  return {.from = from,
          .to = to,
          .mean = motion.mean,
          .information = information_of(motion),
          .by_parameters = motion.by_parameters,
          .by_bias = motion.by_bias,
          .reading_errors = motion.reading_errors};
}

// What is not known of the bias at the start is noise of the motion, and of the bias at its end.
MotionLink link_from(const KnownStart& start, int to, const FreeMotion& motion) {
  FreeMotion open = motion;
  open.covariance += start.bias_variance * motion.by_bias * motion.by_bias.transpose();
  open.with_walk += start.bias_variance * motion.by_bias;
  open.walk += start.bias_variance;
  MotionLink link = link_of(MotionLink::kKnown, to, open);
  link.start = start.pose;
  link.start_bias = start.bias;
  return link;
}

KnownStart start_of(const MotionLink& link, const SmoothingState& state) {
  if (link.from == MotionLink::kKnown) return {link.start, link.start_bias};
  return {state.poses[nth(link.from)], state.bias_at(link.from)};
}

// Eq. 1, 5.
MotionResidual motion_residual(const MotionLink& link, const SmoothingState& state) {
  const KnownStart start = start_of(link, state);
  const Pose2& from = start.pose;
  const Pose2& to = state.poses[nth(link.to)];
  const Twist2 xi = log(link.mean.inverse() * (from.inverse() * to));
  const Matrix3 by_to = right_jacobian_inverse(xi);
  MotionResidual residual;
  residual.error = motion_error(link, start.bias, xi, state);
  residual.by_to = Eigen::Matrix4d::Identity();
  residual.by_to.topLeftCorner<3, 3>() = by_to;
  residual.by_from = Eigen::Matrix4d::Zero();
  residual.by_from.topLeftCorner<3, 3>() = -by_to * adjoint(to.inverse() * from);
  residual.by_from.topRightCorner<3, 1>() = -link.by_bias;
  residual.by_from(3, 3) = -1.0;
  return residual;
}

// Eq. 13d.
void correct_readings(const SmoothingState& state, SmoothingProblem& problem) {
  for (MotionLink& link : problem.motions) {
    const ReadingErrors& errors = link.reading_errors;
    if (errors.covariance.cols() == 0) continue;
    auto W = link.information.topLeftCorner<3, 3>();
    const Vector3 w = W * motion_residual(link, state).error.head<3>();
    for (Eigen::Index j = 0; 3 * j < errors.sensitivity.cols(); ++j) {
      const Vector3 change = errors.sensitivity.middleCols<3>(3 * j) * w;
      link.by_parameters.col(j) += no_larger_than(link.by_parameters.col(j), change, W);
    }
    Matrix3 change = Matrix3::Zero();
    for (Eigen::Index i = 0; i < 3; ++i) change += w[i] * errors.covariance.middleCols<3>(3 * i);
    W = changed_by(change, W.inverse()).inverse().eval();
  }
}

// Eq. 2, 6, 13a.
SightingResidual sighting_residual(const LandmarkSensor& sensor, const Observation& observation,
                                   const Pose2& pose, const Vector2& landmark, const SensorErrors& errors) {
  const Vector2 root_information(1.0 / sensor.range_sigma_m, 1.0 / sensor.bearing_sigma_rad);
  Pose2 body_from_sensor = sensor.body_from_sensor;
  body_from_sensor.x += errors[3];
  body_from_sensor.y += errors[4];
  ExpectedReading expected = expected_reading(pose, body_from_sensor, landmark);
  // Depths are compared as they are read: what the bearing would be decides how much of a distance is read.
  const double range_m = expected.range_m;
  const double depth_share = sensor.depth_share + errors[5];
  const double axis_rad = expected.bearing_rad + sensor.bearing_offset_rad + errors[2];
  const double aside = 1.0 - std::cos(axis_rad);
  const double along_ray = 1.0 - depth_share * aside;
  const double by_bearing = -depth_share * std::sin(axis_rad) * range_m;
  const double growth = 1.0 + errors[1];
  Observation read = observation;
  read.range_m *= sensor.along_ray(observation.bearing_rad + sensor.bearing_offset_rad);
  expected.range_m = growth * along_ray * range_m + errors[0];
  expected.bearing_rad += errors[2];
  expected.by_pose.row(0) =
      growth * (along_ray * expected.by_pose.row(0) + by_bearing * expected.by_pose.row(1));
  expected.by_landmark.row(0) =
      growth * (along_ray * expected.by_landmark.row(0) + by_bearing * expected.by_landmark.row(1));
  SightingResidual residual;
  residual.error = root_information.cwiseProduct(innovation_of(read, expected));
  residual.by_pose = -(root_information.asDiagonal() * expected.by_pose * world_from_body_axes(pose));
  residual.by_landmark = -(root_information.asDiagonal() * expected.by_landmark);
  residual.by_sensor.setZero();
  residual.by_sensor.row(0) << 1.0, along_ray * range_m, growth * by_bearing, 0.0, 0.0,
      -growth * range_m * aside;
  residual.by_sensor.row(0) *= -root_information.x();
  residual.by_sensor(1, 2) = -root_information.y();
  residual.by_sensor.middleCols<2>(3) = -residual.by_landmark * rotation(pose.heading);
  return residual;
}

Eigen::Matrix2Xd through_errors_of(int sensor, const SmoothingProblem& problem,
                                   const Eigen::Matrix<double, 2, 6>& by_sensor) {
  if (problem.sensor_errors.empty()) return Eigen::Matrix2Xd(2, 0);
  return by_sensor * problem.sensor_errors[nth(sensor)];
}

SightingResidual sighting_residual(const SmoothingProblem& problem, const SightingLink& link,
                                   const SmoothingState& state) {
  return sighting_residual(problem.sensors[nth(link.sensor)], link.observation, state.poses[nth(link.pose)],
                           state.landmarks[nth(link.landmark)], errors_of(link.sensor, problem, state));
}

RobotResidual robot_residual(const SmoothingProblem& problem, const RobotLink& link,
                             const SmoothingState& state) {
  const Pose2& seen = state.poses[nth(link.seen)];
  const SightingResidual r =
      sighting_residual(problem.sensors[nth(link.sensor)], link.observation, state.poses[nth(link.pose)],
                        seen * link.marker_on_seen, errors_of(link.sensor, problem, state));
  const LandmarkSensor& sensor = problem.sensors[nth(link.sensor)];
  const double across_rad = link.marker_sigma_m / link.observation.range_m;
  const Vector2 share(sensor.range_sigma_m / std::hypot(sensor.range_sigma_m, link.marker_sigma_m),
                      sensor.bearing_sigma_rad / std::hypot(sensor.bearing_sigma_rad, across_rad));
  const Vector2 by_turn(-link.marker_on_seen.y(), link.marker_on_seen.x());
  Matrix23 marker_by_seen;
  marker_by_seen << Matrix2::Identity(), by_turn;
  const Matrix2 by_marker = r.by_landmark * rotation(seen.heading);
  return {share.cwiseProduct(r.error), share.asDiagonal() * r.by_pose,
          share.asDiagonal() * by_marker * marker_by_seen, share.asDiagonal() * r.by_sensor};
}

// Eq. 13g.
PositionResidual position_residual(const PositionLink& link, const SmoothingState& state) {
  const Pose2& pose = state.poses[nth(link.pose)];
  Matrix23 by_pose;
  by_pose << Matrix2::Identity(), Vector2(-link.on_body.y(), link.on_body.x());
  return {(link.position - pose * link.on_body) / link.sigma_m,
          rotation(pose.heading) * by_pose / -link.sigma_m};
}

double cost_of(const SmoothingProblem& problem, const SmoothingState& state) {
  const Eigen::VectorXd off =
      problem.parameter_mean.size() == 0 ? state.parameters : state.parameters - problem.parameter_mean;
  double cost = off.cwiseAbs2().dot(problem.parameter_information);
  const Information& evidence = problem.parameter_evidence;
  if (evidence.count > 0)
    cost +=
        evidence.chi2 + state.parameters.dot(evidence.matrix * state.parameters - 2.0 * evidence.gradient);
  for (const MotionLink& link : problem.motions) {
    const auto [from, bias, variance] = start_of(link, state);
    const Twist2 xi = log(link.mean.inverse() * (from.inverse() * state.poses[nth(link.to)]));
    const Eigen::Vector4d error = motion_error(link, bias, xi, state);
    cost += error.dot(link.information * error);
  }
  for (const BiasLink& link : problem.bias_readings)
    cost += std::pow(state.bias_at(link.pose) - link.value, 2) / link.variance;
  for (const SightingLink& link : problem.sightings)
    cost += robust_cost(sighting_residual(problem, link, state).error.squaredNorm(), problem.gate);
  for (const RobotLink& link : problem.robots_seen)
    cost += robust_cost(robot_residual(problem, link, state).error.squaredNorm(), problem.gate);
  for (const PositionLink& link : problem.positions)
    cost += robust_cost(position_residual(link, state).error.squaredNorm(), problem.gate);
  return cost;
}

}  // namespace trundle::slam
