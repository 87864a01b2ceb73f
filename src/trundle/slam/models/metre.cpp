#include "trundle/slam/models/metre.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/odometry/uncertain.hpp"

namespace trundle::slam {

Matrix2 Metre::covariance_at(const Vector2& place) const {
  const Vector2 off = sigma * (place - start);
  return off * off.transpose();
}

void Metre::add_to(Trajectory& trajectory) const {
  for (std::size_t k = 0; k < trajectory.covariances.size(); ++k)
    trajectory.covariances[k].topLeftCorner<2, 2>() += covariance_at(trajectory.poses[k].pose.translation());
}

void Metre::add_to(PoseEstimate& estimate) const {
  estimate.covariance.topLeftCorner<2, 2>() += covariance_at(estimate.pose.translation());
}

std::optional<double> metre_sigma(const Robot& robot) {
  const odometry::UncertainParameters known = odometry::uncertain_parameters(robot, true);
  const auto scale = std::ranges::find(known.parameters, ParameterKind::sensor_range_scale, &Parameter::kind);
  if (scale == known.parameters.end()) return std::nullopt;
  const auto k = scale - known.parameters.begin();
  return std::sqrt(known.covariance(k, k)) / robot.landmark_sensor->range_scale;
}

}  // namespace trundle::slam
