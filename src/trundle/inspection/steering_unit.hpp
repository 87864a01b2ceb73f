#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/overview.hpp"

namespace trundle::inspection {

/// Angles of steered wheels in degrees that were read as radians, or the other way round: read otherwise the
/// wheels turn the robot as gyro or reference do, and as they were read they do not. Where nothing else sees
/// it turn, angles in degrees go all round the circle; so do those of
/// counts of which a revolution has more than the robot file says.
[[nodiscard]] std::optional<Finding> wrong_steering_unit(const Recording& recording, const Robot& robot,
                                                         const Overview& overview);

}  // namespace trundle::inspection
