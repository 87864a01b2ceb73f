#pragma once

#include <span>
#include <string>
#include <string_view>

#include "trundle/chassis/robot.hpp"

namespace trundle::calibration {

/// "ros2_control", "road_runner", "ardupilot", "wpilib", "robot_localization".
std::span<const std::string_view> export_formats();
/// How the name of such a file ends: "ros2_control.yaml", "road_runner.java", "ardupilot.param",
/// "wpilib.java", "robot_localization.yaml".
std::string_view export_suffix(std::string_view format);

/// A calibrated robot in the words of another stack: docs/export.md. `nominal` is what that stack has been
/// told so far. `format` is one of export_formats(). Throws CannotAnswer when the stack has no words for such
/// a chassis.
std::string export_robot(std::string_view format, const Robot& nominal, const Robot& calibrated);

}  // namespace trundle::calibration
