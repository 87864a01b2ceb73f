#include "trundle/slam/models/motion.hpp"

#include <algorithm>

namespace trundle::slam {

BySystematic Motion::by_first(Eigen::Index count) const {
  const Eigen::Index known = std::min(count, by_systematic.cols());
  BySystematic all = BySystematic::Zero(3, count);
  all.leftCols(known) = by_systematic.leftCols(known);
  return all;
}

// ∂ξ/∂s: (dx, dy) by the error of travel, dθ by that of turning, and dx of turning by the third.
Motion motion_of(const Twist2& twist, const Matrix3& covariance) {
  Matrix3 by_shares = Matrix3::Zero();
  by_shares.col(0) << twist.dx, twist.dy, 0.0;
  by_shares(2, 1) = twist.dtheta;
  by_shares(2, 2) = twist.dx;
  Motion motion{exp(twist), covariance};
  motion.by_systematic = right_jacobian(twist) * by_shares;
  return motion;
}

// e = Ad e₁ + e₂ + S₂ w₁, w = w₁ + w₂, of w the first component alone. Eq. 1a.
Motion operator*(const Motion& first, const Motion& second) {
  const Matrix3 Ad = adjoint(second.mean.inverse());
  const Eigen::Index count = std::max(first.by_systematic.cols(), second.by_systematic.cols());
  Motion both{first.mean * second.mean, Ad * first.covariance * Ad.transpose() + second.covariance};
  both.by_systematic = Ad * first.by_first(count) + second.by_first(count);
  both.walk = first.walk + second.walk;
  if (first.walk == 0.0) {
    both.with_walk = second.with_walk;
    return both;
  }
  const Vector3 by_walk = second.by_first(1).col(0);
  const Vector3 carried = Ad * first.with_walk;
  both.covariance += carried * by_walk.transpose() + by_walk * carried.transpose() +
                     first.walk * by_walk * by_walk.transpose();
  both.with_walk = carried + first.walk * by_walk + second.with_walk;
  return both;
}

Motion about(const Systematic& reference, const Motion& motion) {
  Motion same = motion;
  same.mean = motion.mean * exp(Twist2::from(motion.by_first(reference.size()) * reference));
  return same;
}

}  // namespace trundle::slam
