#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/align.hpp"

namespace trundle::inspection {

/// What one mistake makes landmarks move while the robot drives past them: bearings that count to the right,
/// ranges in another unit, a sensor that looks elsewhere or stands elsewhere than the robot file says. Only
/// landmarks with a name tell. Nothing where the sightings fit the motion, or no single mistake explains
/// them.
std::optional<Finding> wrong_sightings(const Recording& recording, const Robot& robot,
                                       const AlignedReadings& readings);

}  // namespace trundle::inspection
