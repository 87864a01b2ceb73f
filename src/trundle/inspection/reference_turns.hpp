#pragma once

#include "trundle/calibration/problem/run.hpp"
#include "trundle/recording/turns.hpp"

namespace trundle::inspection {

/// How far the robot turns over pieces of half a second, by its wheels (x) and by the headings of the
/// reference (y) [rad].
[[nodiscard]] PairedSums turns_of_reference(const ReferenceStream& reference, const AlignedReadings& readings,
                                            const Robot& robot);

}  // namespace trundle::inspection
