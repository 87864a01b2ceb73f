#pragma once

#include "trundle/geometry/pose2.hpp"

namespace trundle::geometry {

/// A pose and the covariance of its error e in its own frame: truth = mean * exp(e).
struct GaussianPose {
  Pose2 mean;
  Matrix3 covariance = Matrix3::Zero();  ///< of (forward, left, turn) [m, m, rad]
};

/// a * b with independent errors, to first order: Ad(b⁻¹) Σa Ad(b⁻¹)ᵀ + Σb. docs/theory/geometry.md, eq. 11.
[[nodiscard]] GaussianPose operator*(const GaussianPose& a, const GaussianPose& b);
/// Of the pose the other way round: Ad(a) Σ Ad(a)ᵀ. Eq. 12.
[[nodiscard]] GaussianPose inverse(const GaussianPose& a);

/// Turns (forward, left, turn) of a body into (x, y, heading).
[[nodiscard]] Matrix3 world_from_body_axes(const Pose2& pose);

/// The same covariance as that of the errors of (x, y, heading) in world axes, and back. Eq. 13.
[[nodiscard]] Matrix3 world_covariance(const GaussianPose& pose);
[[nodiscard]] Matrix3 body_covariance(const Pose2& pose, const Matrix3& covariance_in_world);

/// 1σ of a position: √(σx² + σy²), the root of the mean square distance from the truth [m]. Of a covariance
/// of (x, y) or of (x, y, heading).
[[nodiscard]] double position_sigma(const Matrix2& covariance);
[[nodiscard]] double position_sigma(const Matrix3& covariance);

/// vᵀ S⁻¹ v: the squared Mahalanobis distance of v from zero, where S is its covariance.
[[nodiscard]] double squared_mahalanobis(const Vector2& v, const Matrix2& S);

}  // namespace trundle::geometry
