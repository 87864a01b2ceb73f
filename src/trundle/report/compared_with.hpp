#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/geometry/trajectory.hpp"

namespace trundle {

/// What trajectories are compared with.
struct ComparedWith {
  Trajectory reference;                       ///< of the reference sensor; no poses: nothing
  std::optional<Robot> robot = std::nullopt;  ///< where the sensor is on the body; nothing: the body's origin
};

}  // namespace trundle
