#pragma once

#include <span>

#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

/// Whether the positions of a reference without headings bend the way the wheels turn the robot, and not the
/// way of a gyro that turns the other way. False where they do not show it.
[[nodiscard]] bool positions_bend_as_wheels_turn(std::span<const Run> runs, const Robot& robot);

/// Whether they clearly bend the other way.
[[nodiscard]] bool positions_bend_against_wheels(std::span<const Run> runs, const Robot& robot);

}  // namespace trundle::calibration
