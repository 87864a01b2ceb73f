#include "trundle/inspection/geometry_checks.hpp"

#include <cmath>

#include "trundle/chassis/rows.hpp"
#include "trundle/geometry/angle.hpp"

namespace trundle::inspection {
namespace {

/// Two wheels in one place that read the same show nothing that one does not.
void find_wheels_in_one_place(const Robot& robot, std::vector<Finding>& problems) {
  const auto wheels = robot.chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    for (std::size_t j = i + 1; j < wheels.size(); ++j)
      if (wheels[i].x_m == wheels[j].x_m && wheels[i].y_m == wheels[j].y_m &&
          rolling_row(wheels[i]) == rolling_row(wheels[j]))
        problems.push_back({.code = FindingCode::geometry,
                            .place = place_of(robot),
                            .subjects = {robot.wheel_names[i], robot.wheel_names[j]}});
}

/// Of wheels that do not skid sideways and are not steered all axles are parallel, or the robot cannot drive
/// straight in any direction.
void find_crossing_axles(const Robot& robot, std::vector<Finding>& problems) {
  constexpr double kParallel_rad = radians(15.0);  // beyond what calibration allows directions to be off
  const auto stays_ahead = [](const Wheel& wheel) {
    return wheel.kind == WheelKind::fixed && !wheel.steering;
  };
  const auto wheels = robot.chassis.all_wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    for (std::size_t j = i + 1; j < wheels.size(); ++j) {
      if (!stays_ahead(wheels[i]) || !stays_ahead(wheels[j])) continue;
      const double apart_rad = wrap_angle(wheels[j].direction_rad - wheels[i].direction_rad);
      if (std::abs(std::sin(apart_rad)) < std::sin(kParallel_rad)) continue;
      problems.push_back({.code = FindingCode::geometry,
                          .place = place_of(robot),
                          .subjects = {wheel_name(robot, i), wheel_name(robot, j)},
                          .payload = recording::payload::Amount{degrees(std::abs(apart_rad))}});
      return;  // one pair says it
    }
}

}  // namespace

std::vector<Finding> wrong_geometry(const Robot& robot) {
  std::vector<Finding> problems;
  find_wheels_in_one_place(robot, problems);
  find_crossing_axles(robot, problems);
  return problems;
}

}  // namespace trundle::inspection
