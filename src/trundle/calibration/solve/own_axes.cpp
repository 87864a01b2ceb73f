#include "trundle/calibration/solve/own_axes.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/calibration/problem/problem.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {

std::optional<Eigen::VectorXd> axes_turned(std::span<const Parameter> parameters, const Robot& robot) {
  Eigen::VectorXd turned = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
  std::size_t wheels = 0;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    double& change = turned[static_cast<Eigen::Index>(j)];
    switch (parameters[j].kind) {
      case ParameterKind::direction:
        change = 1.0;
        ++wheels;
        break;
      case ParameterKind::reference_heading:
        change = 1.0;
        break;
      case ParameterKind::reference_x:
        change = -robot.body_from_reference.y;
        break;
      case ParameterKind::reference_y:
        change = robot.body_from_reference.x;
        break;
      case ParameterKind::sensor_bearing_offset:
        change = -1.0;
        break;
      case ParameterKind::sensor_x:
        change = -robot.landmark_sensor->body_from_sensor.y;
        break;
      case ParameterKind::sensor_y:
        change = robot.landmark_sensor->body_from_sensor.x;
        break;
      default:
        break;
    }
  }
  const bool all_free = wheels > 0 && wheels == robot.chassis.all_wheels().size();
  return all_free ? std::optional(turned) : std::nullopt;
}

std::vector<Eigen::VectorXd> origin_moved(std::span<const Parameter> parameters, const Robot& robot) {
  const std::span<const Wheel> wheels = robot.chassis.all_wheels();
  const auto is_lever = [](const Parameter& parameter) { return parameter.kind == ParameterKind::lever; };
  const bool all_free = !wheels.empty() &&
                        std::ranges::count_if(parameters, is_lever) == std::ssize(wheels) &&
                        std::ranges::all_of(wheels, [](const Wheel& w) { return w.kind == WheelKind::omni; });
  std::vector<Eigen::VectorXd> moved;
  const auto move = [&](ParameterKind place, const Vector2& ahead) {
    if (!all_free || !contains(parameters, place)) return;
    Eigen::VectorXd change = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      if (parameters[j].kind == place) change[static_cast<Eigen::Index>(j)] = -1.0;
      if (!is_lever(parameters[j])) continue;
      const double direction_rad = wheels[static_cast<std::size_t>(parameters[j].wheel)].direction_rad;
      change[static_cast<Eigen::Index>(j)] =
          ahead.y() * std::cos(direction_rad) - ahead.x() * std::sin(direction_rad);
    }
    moved.push_back(change);
  };
  move(ParameterKind::sensor_x, Vector2::UnitX());
  move(ParameterKind::sensor_y, Vector2::UnitY());
  return moved;
}

Eigen::MatrixXd with_held(const Eigen::MatrixXd& directions, const Eigen::VectorXd& scale,
                          const Eigen::MatrixXd& information) {
  if (directions.cols() == 0) return information;
  const auto per_scale = scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd others = orthogonal_complement(per_scale * directions);
  const Eigen::MatrixXd held = scale.asDiagonal() * others * others.transpose() * per_scale;
  return held.transpose() * information * held;
}

}  // namespace trundle::calibration
