#pragma once

#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::inspection {

/// What was measured of a run as a whole against what its wheels and gyro say of it: a distance in another
/// unit, an end that is not that of this run, turns in degrees or the other way round.
std::vector<Finding> wrong_partial_reference(const Recording& recording, const Robot& robot,
                                             const AlignedReadings& readings);

}  // namespace trundle::inspection
