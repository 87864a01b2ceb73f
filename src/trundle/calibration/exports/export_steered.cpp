#include "trundle/calibration/exports/export_steered.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/ranges.h>

#include "trundle/calibration/exports/export_words.hpp"

namespace trundle::calibration {
namespace {

/// Indices as Chassis::all_wheels().
using WheelIndices = std::vector<std::size_t>;

template <class Condition>
WheelIndices wheels_where(const Robot& robot, Condition holds) {
  WheelIndices found;
  for (std::size_t i = 0; i < robot.chassis.all_wheels().size(); ++i)
    if (holds(i)) found.push_back(i);
  return found;
}

const Wheel& wheel_at(const Robot& robot, std::size_t index) {
  return robot.chassis.all_wheels()[index];
}

/// Names of joints, as a YAML list.
std::string joints(const Robot& robot, const WheelIndices& wheels) {
  std::vector<std::string> names;
  for (const std::size_t i : wheels) names.push_back(wheel_name(robot, i));
  return fmt::format("[\"{}\"]", fmt::join(names, "\", \""));
}

double mean_x_m(const Robot& robot, const WheelIndices& wheels) {
  double sum = 0.0;
  for (const std::size_t i : wheels) sum += wheel_at(robot, i).x_m;
  return sum / static_cast<double>(wheels.size());
}

double distance_m(const Robot& robot, const WheelIndices& two) {
  return std::abs(wheel_at(robot, two[0]).y_m - wheel_at(robot, two[1]).y_m);
}

/// The controllers take the joint's position for the angle from ahead.
std::string steering_comment(const Robot& robot, std::size_t index) {
  const Wheel& wheel = wheel_at(robot, index);
  const SteeringSensor& steering = *wheel.steering;
  return fmt::format("# joint of '{}': position = {:.9g} * (reading - {:.9g}) rad\n",
                     wheel_name(robot, index), steering.scale,
                     steering.zero_rad - wheel.direction_rad / steering.scale);
}

/// They have one radius and know of no wheel off the middle.
std::string simplification_comment(const Robot& robot, const WheelIndices& driven,
                                   const WheelIndices& steered) {
  std::string text;
  if (driven.size() == 2)
    text +=
        fmt::format("# the radius is the mean of {:.9g} and {:.9g}\n",
                    0.5 * wheel_at(robot, driven[0]).diameter_m, 0.5 * wheel_at(robot, driven[1]).diameter_m);
  if (steered.size() == 1 && wheel_at(robot, steered[0]).y_m != 0.0)
    text += fmt::format("# '{}' stands {:.9g} m left of the middle: the controller does not know it\n",
                        wheel_name(robot, steered[0]), wheel_at(robot, steered[0]).y_m);
  return text;
}

double mean_radius_m(const Robot& robot, const WheelIndices& driven) {
  double sum = 0.0;
  for (const std::size_t i : driven) sum += 0.5 * wheel_at(robot, i).diameter_m;
  return sum / static_cast<double>(driven.size());
}

bool roll_forwards(const Robot& robot, const WheelIndices& wheels) {
  return std::ranges::all_of(
      wheels, [&](std::size_t i) { return std::abs(wheel_at(robot, i).direction_rad) < radians(1.0); });
}

/// As an identifier of Java.
std::string identifier(std::string name) {
  std::ranges::replace(name, '-', '_');
  return name;
}

}  // namespace

std::string ros2_control_of_steered(const Robot& robot) {
  const auto driven = wheels_where(robot, [&](std::size_t i) { return i < robot.chassis.wheels().size(); });
  const auto steered =
      wheels_where(robot, [&](std::size_t i) { return wheel_at(robot, i).steering.has_value(); });
  const auto axle = wheels_where(robot, [&](std::size_t i) { return !wheel_at(robot, i).steering; });
  const bool tricycle = driven.size() == 1 && driven == steered && !axle.empty();
  const bool car = driven.size() == 2 && driven == axle && !steered.empty() && steered.size() <= 2;
  if ((!tricycle && !car) || !roll_forwards(robot, driven))
    refuse_export(
        "ros2_control", robot,
        "its controllers steer one driven wheel before an axle, or one or two before two driven ones");
  std::string text = export_head(robot, "#");
  text += "# The names of the joints are those of robot.toml: replace them by your own.\n";
  for (const std::size_t i : steered) text += steering_comment(robot, i);
  text += simplification_comment(robot, driven, steered);
  const double wheelbase_m = mean_x_m(robot, steered) - mean_x_m(robot, axle);
  const double radius_m = mean_radius_m(robot, driven);
  if (tricycle) {
    const std::string& name = wheel_name(robot, driven[0]);
    text += fmt::format(
        "tricycle_controller:\n  ros__parameters:\n    traction_joint_name: \"{0}\"\n"
        "    steering_joint_name: \"{0}_steering\"\n    wheelbase: {1}\n    wheel_radius: {2}\n",
        name, ros_double(wheelbase_m), ros_double(radius_m));
    return text;
  }
  const bool two = steered.size() == 2;
  text +=
      "# Up to Jazzy: rear_wheels_names, front_wheels_names, rear_wheel_track (wheel_track), "
      "front_wheel_track,\n";
  text += "# rear_wheels_radius.\n";
  text += fmt::format("{}_steering_controller:\n  ros__parameters:\n", two ? "ackermann" : "tricycle");
  text += fmt::format("    traction_joints_names: {}\n", joints(robot, driven));
  text += fmt::format("    steering_joints_names: {}\n", joints(robot, steered));
  text += fmt::format("    wheelbase: {}\n", ros_double(wheelbase_m));
  text += fmt::format("    traction_track_width: {}\n", ros_double(distance_m(robot, driven)));
  if (two) text += fmt::format("    steering_track_width: {}\n", ros_double(distance_m(robot, steered)));
  text += fmt::format("    traction_wheels_radius: {}\n", ros_double(radius_m));
  return text;
}

std::string wpilib_swerve(const Robot& robot) {
  const auto wheels = robot.chassis.all_wheels();
  const bool swerve = robot.chassis.passive_count == 0 && wheels.size() >= 2 &&
                      std::ranges::all_of(wheels, [](const Wheel& w) { return w.steering.has_value(); });
  if (!swerve) refuse_export("wpilib", robot, "its modules are steered and driven, all of them");
  std::string text = export_head(robot, "//");
  std::vector<std::string> places;
  for (std::size_t i = 0; i < wheels.size(); ++i) {
    const Wheel& wheel = wheels[i];
    const SteeringSensor& steering = *wheel.steering;
    const std::string name = identifier(robot.wheel_names[i]);
    text += fmt::format("public static final Translation2d {}Location = new Translation2d({:.9g}, {:.9g});\n",
                        name, wheel.x_m, wheel.y_m);
    text += fmt::format(
        "public static final Rotation2d {}Offset = Rotation2d.fromRadians({:.9g}); // angle = {:.9g} * "
        "(reading - offset)\n",
        name, steering.zero_rad - wheel.direction_rad / steering.scale, steering.scale);
    text +=
        fmt::format("public static final double {}WheelDiameterMeters = {:.9g};\n", name, wheel.diameter_m);
    places.push_back(name + "Location");
  }
  text +=
      fmt::format("public static final SwerveDriveKinematics kinematics = new SwerveDriveKinematics({});\n",
                  fmt::join(places, ", "));
  return text;
}

}  // namespace trundle::calibration
