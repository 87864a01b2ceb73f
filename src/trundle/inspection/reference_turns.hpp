#pragma once

#include <optional>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/recording/turns.hpp"

namespace trundle::inspection {

/// How far the robot turns over pieces of half a second, by its wheels (x) and by the headings of the
/// reference (y) [rad].
[[nodiscard]] PairedSums turns_of_reference(const ReferenceStream& reference, const AlignedReadings& readings,
                                            const Robot& robot);

/// The turns by the wheels and by what else sees them: the gyro, as given, or else the reference. Nothing
/// where that hardly turns.
[[nodiscard]] std::optional<PairedSums> turns_beside(const Recording& recording, const Robot& robot,
                                                     const PairedSums& by_gyro);

}  // namespace trundle::inspection
