#include "trundle/geometry/pose2.hpp"

#include <Eigen/LU>

namespace trundle::geometry {
namespace {

/// V(θ) of eq. 2: the translation of exp is V(θ) · (dx, dy).
Matrix2 arc_matrix(double theta) {
  const double s = sinc(theta);
  const double c = cosc(theta);
  return (Matrix2() << s, -c, c, s).finished();
}

}  // namespace

Matrix2 rotation(double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return (Matrix2() << c, -s, s, c).finished();
}

Pose2 Pose2::inverse() const {
  const Vector2 t = -(rotation(-heading) * translation());
  return {t.x(), t.y(), -heading};
}

Pose2 operator*(const Pose2& a, const Pose2& b) {
  const Vector2 t = a * b.translation();
  return {t.x(), t.y(), a.heading + b.heading};
}

Vector2 operator*(const Pose2& frame_from_other, const Vector2& point_in_other) {
  return frame_from_other.translation() + rotation(frame_from_other.heading) * point_in_other;
}

// Eq. 1.
Pose2 exp(const Twist2& twist) {
  const Vector2 t = arc_matrix(twist.dtheta) * Vector2(twist.dx, twist.dy);
  return {t.x(), t.y(), twist.dtheta};
}

Twist2 log(const Pose2& pose) {
  const double theta = wrap_angle(pose.heading);
  // Eq. 3: V⁻¹ = [h, θ/2; −θ/2, h] with h = (θ/2) cot(θ/2) = cos(θ/2)/sinc(θ/2).
  const double h = std::cos(0.5 * theta) / sinc(0.5 * theta);
  return {h * pose.x + 0.5 * theta * pose.y, h * pose.y - 0.5 * theta * pose.x, theta};
}

// Eq. 5.
Matrix3 adjoint(const Pose2& pose) {
  Matrix3 Ad = Matrix3::Identity();
  Ad.topLeftCorner<2, 2>() = rotation(pose.heading);
  Ad(0, 2) = pose.y;
  Ad(1, 2) = -pose.x;
  return Ad;
}

// Eq. 8.
Matrix3 left_jacobian(const Twist2& twist) {
  const double theta = twist.dtheta;
  const double half = sinc(0.5 * theta);
  const double a = sinc_derivative(theta) + cosc(theta);  // (θ − sin θ)/θ², without its cancellation near 0
  const double b = 0.5 * half * half;                     // (1 − cos θ)/θ²
  Matrix3 J = Matrix3::Identity();
  J.topLeftCorner<2, 2>() = arc_matrix(theta);
  J(0, 2) = a * twist.dx + b * twist.dy;
  J(1, 2) = a * twist.dy - b * twist.dx;
  return J;
}

// Eq. 9.
Matrix3 right_jacobian(const Twist2& twist) {
  return left_jacobian({-twist.dx, -twist.dy, -twist.dtheta});
}
Matrix3 right_jacobian_inverse(const Twist2& twist) {
  return right_jacobian(twist).inverse();
}

}  // namespace trundle::geometry
