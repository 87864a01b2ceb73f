#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/geometry/trajectory.hpp"
#include "trundle/recording/reference_noise.hpp"

namespace trundle::report {

/// What trajectories are compared with.
struct ComparedWith {
  Trajectory reference;                       ///< of the reference sensor; no poses: nothing
  ReferenceSigmas noise = {};                 ///< of the reference
  std::optional<Robot> robot = std::nullopt;  ///< where the sensor is on the body; nothing: the body's origin
};

}  // namespace trundle::report
