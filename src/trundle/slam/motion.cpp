#include "trundle/slam/motion.hpp"

namespace trundle {

// ∂ξ/∂s: (dx, dy) by the error of travel, dθ by that of turning, and dx of turning by the third.
Motion motion_of(const Twist2& twist, const Matrix3& covariance) {
  Matrix3 by_systematic = Matrix3::Zero();
  by_systematic.col(0) << twist.dx, twist.dy, 0.0;
  by_systematic(2, 1) = twist.dtheta;
  by_systematic(2, 2) = twist.dx;
  return {exp(twist), covariance, right_jacobian(twist) * by_systematic};
}

Motion operator*(const Motion& first, const Motion& second) {
  const Matrix3 Ad = adjoint(second.mean.inverse());
  return {first.mean * second.mean, Ad * first.covariance * Ad.transpose() + second.covariance,
          Ad * first.by_systematic + second.by_systematic};
}

}  // namespace trundle
