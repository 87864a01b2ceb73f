#pragma once

#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/finding.hpp"

namespace trundle::inspection {

/// Wheels that cannot be where, or what, the robot file says, whatever was recorded.
[[nodiscard]] std::vector<Finding> wrong_geometry(const Robot& robot);

}  // namespace trundle::inspection
