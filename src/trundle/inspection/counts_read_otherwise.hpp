#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/overview.hpp"

namespace trundle::inspection {

/// Counts since the row before that were read as counters that go on, or the other way round: read otherwise
/// the wheels turn the robot as gyro or reference do, and as they were read they do not. Nothing where that
/// is not so, or nothing but the wheels sees the robot turn.
[[nodiscard]] std::optional<Finding> counts_read_otherwise(const Recording& recording, const Robot& robot,
                                                           const Overview& overview);

}  // namespace trundle::inspection
