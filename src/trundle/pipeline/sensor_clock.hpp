#pragma once

#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::pipeline {

/// A warning where the landmark sensor's clock is not what the robot file says, by how the robot moves. All
/// that is estimated from its sightings is off then, by more than it says.
[[nodiscard]] std::vector<Finding> sensor_clock_checks(const Recording& recording,
                                                       const AlignedReadings& readings, const Robot& robot);

}  // namespace trundle::pipeline
