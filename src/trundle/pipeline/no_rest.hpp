#pragma once

#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::pipeline {

/// A run of a robot that may have a gyro.
struct RunOfGyro {
  const Robot& robot;
  double rest_s = 0.0;  ///< how long it stood still
  double duration_s = 0.0;
  double heading_variance = 0.0;  ///< at the end [rad²]
};

/// Notes what a robot pays that never stands still: its gyro's bias is not known. Nothing where that makes
/// less than half of the heading's variance, or where wheels told it.
void report_no_rest(const RunOfGyro& run, std::vector<Finding>& findings);

}  // namespace trundle::pipeline
