#pragma once

#include <Eigen/Cholesky>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/odometry/integrate.hpp"

namespace trundle::slip {

/// Of e = Log(T̂⁻¹ T) at the end of corrected readings; 3 on average where the covariance is honest.
inline double nees_at_end(const AlignedReadings& corrected, const Robot& robot, const Trajectory& truth) {
  const Trajectory trajectory = integrate(corrected, robot).trajectory;
  const Pose2& end = trajectory.poses.back().pose;
  const Vector3 e = log(end.inverse() * truth.poses.back().pose).vector();
  return e.dot(body_covariance(end, trajectory.covariances.back()).llt().solve(e));
}

}  // namespace trundle::slip
