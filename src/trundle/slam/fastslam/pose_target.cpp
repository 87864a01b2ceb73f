#include "trundle/slam/fastslam/pose_target.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/odometry/arc.hpp"
#include "trundle/slam/cholesky.hpp"

namespace trundle::slam {
namespace {

Matrix2 innovation_covariance(const Sight& s) {
  return (Matrix2() << s.p_along + s.r_along, s.p_mixed, s.p_mixed, s.p_across + s.r_across).finished();
}

}  // namespace

ReadingTerms reading_terms(const Observation& observation, const LandmarkSensor& sensor) {
  return {observation.range_m, std::cos(observation.bearing_rad), std::sin(observation.bearing_rad),
          sensor.range_sigma_m * sensor.range_sigma_m, sensor.bearing_sigma_rad * sensor.bearing_sigma_rad};
}

SensorAt sensor_at(const Pose2& world_from_body, const Pose2& body_from_sensor) {
  const auto body = sin_cos_of(world_from_body.heading);
  const double bc = std::cos(body_from_sensor.heading);
  const double bs = std::sin(body_from_sensor.heading);
  return {world_from_body.x + body.cos * body_from_sensor.x - body.sin * body_from_sensor.y,
          world_from_body.y + body.sin * body_from_sensor.x + body.cos * body_from_sensor.y,
          body.cos * bc - body.sin * bs, body.sin * bc + body.cos * bs};
}

PoseTarget::PoseTarget(const PoseColumns& predicted, const Matrix3& motion_covariance,
                       const Pose2& body_from_sensor, std::span<const KnownReading> readings)
    : predicted_(predicted),
      body_from_sensor_(body_from_sensor),
      readings_(readings),
      L_(semidefinite_root(motion_covariance)) {}

Vector3 PoseTarget::clamped(const Vector3& n) const {
  const Vector3 limit = 3.0 * L_.rowwise().norm();
  const Vector3 e = L_ * n;
  if ((e.array().abs() <= limit.array()).all()) return n;
  return L_.triangularView<Eigen::Lower>().solve(e.cwiseMax(-limit).cwiseMin(limit));
}

PoseTarget::Value PoseTarget::at(std::size_t particle, const Vector3& n) const {
  const SensorAt sensor = sensor_at(pose(particle, n), body_from_sensor_);
  Value value{-0.5 * n.squaredNorm(), 0.0};
  for (const KnownReading& known : readings_) {
    const Sight sight = sight_of(sensor, known.reading, known.landmark->at(particle));
    value.log_density += log_likelihood_of(sight);
    value.agreement += std::exp(-0.5 * sight.distance2);
  }
  if (!readings_.empty()) value.agreement /= static_cast<double>(readings_.size());
  return value;
}

/// Of the range and of range · bearing: −[uᵀ; tᵀ] by the sensor's place, whose lever turns with the body.
PoseTarget::Matrix23 PoseTarget::derivative(const Pose2& pose, const SensorAt& sensor,
                                            const Sight& sight) const {
  const Vector2 u(sight.ux, sight.uy);
  const Vector2 t(-sight.uy, sight.ux);
  const Vector2 turned_lever(-(sensor.y - pose.y), sensor.x - pose.x);
  const Matrix2 R = rotation(pose.heading);
  Matrix23 by_twist;
  by_twist << -(u.transpose() * R), -u.dot(turned_lever), -(t.transpose() * R),
      -t.dot(turned_lever) - sight.range;
  return by_twist * L_;
}

// Eq. 16.
WhitenedGaussian PoseTarget::gaussian_at(std::size_t particle, const Vector3& n) const {
  const Pose2 at = pose(particle, n);
  const SensorAt sensor = sensor_at(at, body_from_sensor_);
  Matrix3 information = Matrix3::Identity();
  Vector3 gradient = -n;
  for (const KnownReading& known : readings_) {
    const Sight sight = sight_of(sensor, known.reading, known.landmark->at(particle));
    const Matrix23 A = derivative(at, sensor, sight);
    const Matrix23 WA = innovation_covariance(sight).inverse() * A;
    information += A.transpose() * WA;
    gradient += WA.transpose() * Vector2(sight.along, sight.across);
  }
  const Eigen::LLT<Matrix3> factor(information);
  return {n + factor.solve(gradient), factor.matrixL()};
}

PoseTarget::Innovation PoseTarget::innovation(std::size_t particle, const KnownReading& known) const {
  const Pose2 at = predicted(particle);
  const SensorAt sensor = sensor_at(at, body_from_sensor_);
  const Sight sight = sight_of(sensor, known.reading, known.landmark->at(particle));
  const Matrix23 A = derivative(at, sensor, sight);
  const Matrix2 S = innovation_covariance(sight) + A * A.transpose();
  const Vector2 innovation(sight.along, sight.across);
  return {{sight.along, sight.across / sight.range}, innovation.dot(S.inverse() * innovation)};
}

}  // namespace trundle::slam
