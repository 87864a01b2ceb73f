#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/overview.hpp"

namespace trundle::inspection {

/// Angles of steered wheels that are misread: in another unit, or from another direction.
[[nodiscard]] std::optional<Finding> wrong_steering(const Recording& recording, const Robot& robot,
                                                    const Overview& overview);

}  // namespace trundle::inspection
