#pragma once

#include <span>
#include <vector>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/fastslam/landmark_kernels.hpp"
#include "trundle/slam/observation.hpp"

namespace trundle::slam {

[[nodiscard]] ReadingTerms reading_terms(const Observation& observation, const LandmarkSensor& sensor);
[[nodiscard]] SensorAt sensor_at(const Pose2& world_from_body, const Pose2& body_from_sensor);

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

}  // namespace trundle::slam
