#pragma once

#include <span>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/cholesky.hpp"
#include "trundle/slam/fastslam/landmark_kernels.hpp"

#include "slam/one_landmark.hpp"

namespace trundle::test {
using namespace slam;

/// A Gaussian of a pose in whitened coordinates n of its prediction: pose = predicted · exp(L n).
struct WhitenedGaussian {
  Vector3 mean = Vector3::Zero();
  Matrix3 information_root = Matrix3::Identity();  ///< lower C with C Cᵀ = inverse covariance
};

/// What one step says of each particle's new pose, given its own map, association and pose before:
/// motion prior times likelihood, up to a constant. docs/theory/fastslam.md, eq. 15. Poses are written as
/// predicted · exp(e), e = L n with L Lᵀ the motion's covariance, so the prior of n is standard normal.
class PoseTarget {
 public:
  /// `predicted`: of each particle, before noise. It and the readings must outlive the target.
  PoseTarget(const PoseColumns& predicted, const Matrix3& motion_covariance, const Pose2& body_from_sensor,
             std::span<const KnownReading> readings);

  [[nodiscard]] Pose2 predicted(std::size_t particle) const { return predicted_.at(particle); }
  [[nodiscard]] Pose2 pose(std::size_t particle, const Vector3& n) const {
    return predicted(particle) * exp(Twist2::from(L_ * n));
  }
  /// 3 σ of each coordinate of e limit how far a search may go; what is within stays.
  [[nodiscard]] Vector3 clamped(const Vector3& n) const;

  struct Value {
    double log_density = 0.0;
    double agreement = 0.0;  ///< mean over the readings of exp(−½ d²)
  };
  [[nodiscard]] Value at(std::size_t particle, const Vector3& n) const;
  /// One Gauss–Newton step from n, and the curvature there.
  [[nodiscard]] WhitenedGaussian gaussian_at(std::size_t particle, const Vector3& n) const;
  /// Squared innovation of one reading at the prediction, in the covariance of landmark, reading and motion.
  struct Innovation {
    Vector2 innovation;  ///< (range, bearing)
    double nis;
  };
  [[nodiscard]] Innovation innovation(std::size_t particle, const KnownReading& reading) const;

 private:
  using Matrix23 = Eigen::Matrix<double, 2, 3>;
  /// ∂(along, across)/∂n at a pose.
  [[nodiscard]] Matrix23 derivative(const Pose2& pose, const SensorAt& sensor, const Sight& sight) const;

  const PoseColumns& predicted_;
  Pose2 body_from_sensor_;
  std::span<const KnownReading> readings_;
  Matrix3 L_;
};

inline Matrix2 innovation_covariance_of(const Sight& s) {
  return (Matrix2() << s.p_along + s.r_along, s.p_mixed, s.p_mixed, s.p_across + s.r_across).finished();
}

inline PoseTarget::PoseTarget(const PoseColumns& predicted, const Matrix3& motion_covariance,
                              const Pose2& body_from_sensor, std::span<const KnownReading> readings)
    : predicted_(predicted),
      body_from_sensor_(body_from_sensor),
      readings_(readings),
      L_(semidefinite_root(motion_covariance)) {}

inline Vector3 PoseTarget::clamped(const Vector3& n) const {
  const Vector3 limit = 3.0 * L_.rowwise().norm();
  const Vector3 e = L_ * n;
  if ((e.array().abs() <= limit.array()).all()) return n;
  return L_.triangularView<Eigen::Lower>().solve(e.cwiseMax(-limit).cwiseMin(limit));
}

inline PoseTarget::Value PoseTarget::at(std::size_t particle, const Vector3& n) const {
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
inline PoseTarget::Matrix23 PoseTarget::derivative(const Pose2& pose, const SensorAt& sensor,
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
inline WhitenedGaussian PoseTarget::gaussian_at(std::size_t particle, const Vector3& n) const {
  const Pose2 at = pose(particle, n);
  const SensorAt sensor = sensor_at(at, body_from_sensor_);
  Matrix3 information = Matrix3::Identity();
  Vector3 gradient = -n;
  for (const KnownReading& known : readings_) {
    const Sight sight = sight_of(sensor, known.reading, known.landmark->at(particle));
    const Matrix23 A = derivative(at, sensor, sight);
    const Matrix23 WA = innovation_covariance_of(sight).inverse() * A;
    information += A.transpose() * WA;
    gradient += WA.transpose() * Vector2(sight.along, sight.across);
  }
  const Eigen::LLT<Matrix3> factor(information);
  return {n + factor.solve(gradient), factor.matrixL()};
}

inline PoseTarget::Innovation PoseTarget::innovation(std::size_t particle, const KnownReading& known) const {
  const Pose2 at = predicted(particle);
  const SensorAt sensor = sensor_at(at, body_from_sensor_);
  const Sight sight = sight_of(sensor, known.reading, known.landmark->at(particle));
  const Matrix23 A = derivative(at, sensor, sight);
  const Matrix2 S = innovation_covariance_of(sight) + A * A.transpose();
  const Vector2 innovation(sight.along, sight.across);
  return {{sight.along, sight.across / sight.range}, innovation.dot(S.inverse() * innovation)};
}

}  // namespace trundle::test
