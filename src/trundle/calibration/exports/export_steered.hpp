#pragma once

#include <string>

#include "trundle/chassis/robot.hpp"

// Robots with steered wheels in the words of other stacks. docs/export.md.
namespace trundle::calibration {

/// Parameters of ros2_control's tricycle_controller (one driven and steered wheel), or of its
/// tricycle_steering_controller or ackermann_steering_controller (two driven wheels, one or two steered
/// ones). Throws CannotAnswer for other robots.
[[nodiscard]] std::string ros2_control_of_steered(const Robot& calibrated);

/// Places, offsets and sizes of WPILib's swerve modules. Throws CannotAnswer where a wheel is not steered and
/// driven.
[[nodiscard]] std::string wpilib_swerve(const Robot& calibrated);

}  // namespace trundle::calibration
