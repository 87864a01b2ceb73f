#pragma once

#include "trundle/recording/increments.hpp"

namespace trundle {

/// Fills in what the gyro turned over each increment, and adds what was found wrong with it to the problems.
void add_gyro(const Recording& recording, const Robot& robot, AlignedReadings& aligned);

}  // namespace trundle
