#pragma once

#include "trundle/geometry/gaussian.hpp"

namespace trundle {

/// Errors that the odometry makes all along a run: of travel and of turning, each as a share of itself, and
/// turning that comes with travel [rad/m]. They are what wrong wheel diameters and a wrong track do.
using Systematic = Vector3;

/// How the body moved over some time, as the odometry tells it:
/// truth = mean · exp(by_systematic · s + e), e ~ N(0, covariance). docs/slam.md, eq. 1.
struct Motion {
  Pose2 mean;
  Matrix3 covariance = Matrix3::Zero();     ///< of (forward, left, turn) in the frame at the end [m, m, rad]
  Matrix3 by_systematic = Matrix3::Zero();  ///< of the same, by s

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.mean, self.covariance, self.by_systematic);
  }
};

/// One interval of constant twist.
Motion motion_of(const Twist2& twist, const Matrix3& covariance);

/// One after the other, with independent noise and the same systematic errors.
Motion operator*(const Motion& first, const Motion& second);

}  // namespace trundle
