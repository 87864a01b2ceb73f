#pragma once

#include <Eigen/Core>

#include "trundle/geometry/angle.hpp"

namespace trundle::geometry {

using Vector2 = Eigen::Vector2d;
using Vector3 = Eigen::Vector3d;
using Matrix2 = Eigen::Matrix2d;
using Matrix3 = Eigen::Matrix3d;

/// A motion in the body's own frame: forward and left [m], counter-clockwise turn [rad].
/// Over an interval of constant twist this is the integral, so that the pose moves by exp().
struct Twist2 {
  double dx = 0.0;
  double dy = 0.0;
  double dtheta = 0.0;

  [[nodiscard]] Vector3 vector() const { return {dx, dy, dtheta}; }
  [[nodiscard]] static Twist2 from(const Vector3& v) { return {v.x(), v.y(), v.z()}; }
};

/// A rigid motion of the plane, or where a frame stands in another: names read as products,
/// world_from_sensor = world_from_body * body_from_sensor.
/// The heading is continuous: composition adds headings and never wraps them, so turns are kept.
struct Pose2 {
  double x = 0.0;        ///< [m]
  double y = 0.0;        ///< [m]
  double heading = 0.0;  ///< [rad], counter-clockwise, not wrapped

  [[nodiscard]] Vector2 translation() const { return {x, y}; }
  [[nodiscard]] Pose2 inverse() const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.x, self.y, self.heading);
  }
};

[[nodiscard]] Pose2 operator*(const Pose2& a, const Pose2& b);
[[nodiscard]] Vector2 operator*(const Pose2& frame_from_other, const Vector2& point_in_other);

/// The pose reached by a constant twist: the exact arc, for any turn. docs/theory/geometry.md, eq. 1.
[[nodiscard]] Pose2 exp(const Twist2& twist);
/// The constant twist that reaches the pose by the shortest turn, dtheta in (−π, π]: the inverse of exp
/// there, and blind to whole turns of the heading. It jumps where the heading crosses ±π.
/// docs/theory/geometry.md, eq. 3.
[[nodiscard]] Twist2 log(const Pose2& pose);

/// Ad(T): T · exp(ξ) · T⁻¹ = exp(Ad(T) ξ). docs/theory/geometry.md, eq. 5.
[[nodiscard]] Matrix3 adjoint(const Pose2& pose);
/// Jr(ξ): exp(ξ + δ) ≈ exp(ξ) · exp(Jr δ); Jl(ξ): exp(ξ + δ) ≈ exp(Jl δ) · exp(ξ). docs/theory/geometry.md,
/// eq. 8, 9.
[[nodiscard]] Matrix3 right_jacobian(const Twist2& twist);
[[nodiscard]] Matrix3 left_jacobian(const Twist2& twist);
/// Jr⁻¹(ξ): log(exp(ξ) · exp(δ)) ≈ ξ + Jr⁻¹ δ. Singular at whole turns, dtheta = ±2π, ...; not at 0.
[[nodiscard]] Matrix3 right_jacobian_inverse(const Twist2& twist);

/// Rotation by an angle [rad] as a 2×2 matrix.
[[nodiscard]] Matrix2 rotation(double angle);

}  // namespace trundle::geometry
