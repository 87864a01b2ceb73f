#include "trundle/slam/models/metre.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::slam {
namespace {

/// Where the scale of ranges is among the parameters; nothing: nowhere.
std::optional<Eigen::Index> place_of_range_scale(const odometry::UncertainParameters& uncertain) {
  const auto at = std::ranges::find(uncertain.parameters, kRangeScale);
  if (at == uncertain.parameters.end()) return std::nullopt;
  return at - uncertain.parameters.begin();
}

}  // namespace

void Metre::add_to(const Pose2& pose, Matrix3& covariance) const {
  const Vector2 off = sigma * (pose.translation() - start);
  covariance.topLeftCorner<2, 2>() += off * off.transpose();
}

void Metre::add_to(Trajectory& trajectory) const {
  for (std::size_t k = 0; k < trajectory.covariances.size(); ++k)
    add_to(trajectory.poses[k].pose, trajectory.covariances[k]);
}

std::optional<double> metre_sigma(const Robot& robot) {
  const odometry::UncertainParameters known = odometry::uncertain_parameters(robot, true);
  const std::optional<Eigen::Index> k = place_of_range_scale(known);
  if (!k) return std::nullopt;
  return std::sqrt(known.covariance(*k, *k)) / robot.landmark_sensor->range_scale;
}

Metre metre_of(const Robot& robot, const Pose2& start) {
  return {metre_sigma(robot).value_or(0.0), start.translation()};
}

void count_in_sensor_metre(odometry::UncertainParameters& uncertain) {
  const std::optional<Eigen::Index> k = place_of_range_scale(uncertain);
  if (!k || uncertain.covariance(*k, *k) == 0.0) return;
  const Eigen::VectorXd with = uncertain.covariance.col(*k);
  uncertain.covariance -= with * with.transpose() / with[*k];
}

}  // namespace trundle::slam
