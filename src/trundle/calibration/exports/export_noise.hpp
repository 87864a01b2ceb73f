#pragma once

#include <string>

#include "trundle/chassis/robot.hpp"

namespace trundle::calibration {

/// Parameters of robot_localization's ekf_node with the covariances of the wheels' odometry and of the gyro,
/// which their publishers must send: docs/export.md. Throws CannotAnswer for wheels that do not see all of
/// the motion when they roll straight ahead.
[[nodiscard]] std::string robot_localization(const Robot& calibrated);

}  // namespace trundle::calibration
