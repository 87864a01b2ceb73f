#pragma once

#include <optional>
#include <span>

#include "trundle/calibration/run.hpp"

namespace trundle::calibration {

/// Where the reference sensor looks [rad, from the body's x axis], by its relative motions: the rotation that
/// lays the directions in which it moves on those in which the wheels roll, while the robot hardly turns.
/// Nothing where it hardly moves or the directions do not agree.
[[nodiscard]] std::optional<double> sensor_heading(std::span<const Run> runs, const Robot& robot);

}  // namespace trundle::calibration
