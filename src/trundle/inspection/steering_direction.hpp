#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/inspect.hpp"

namespace trundle::inspection {

/// A passive steered wheel that rolls far beside where its angles say, as the other sensors move it over the
/// ground: its zero stands for another direction. What is nearer is left to calibration.
[[nodiscard]] std::optional<Finding> wrong_steering_direction(const Recording& recording, const Robot& robot);

}  // namespace trundle::inspection
