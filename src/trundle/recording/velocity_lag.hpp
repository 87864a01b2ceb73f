#pragma once

#include <optional>

#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {

/// By how much a robot's motion lags behind the velocity that a recording has of it
/// (VelocityCorrection::lag_s, as `offset_s`), by how the reference shows it to move or how the bearings of
/// landmarks change. A lag is nearly a delay: what is told apart is how it starts and stops. Nothing where
/// there is nothing to compare, the velocity was measured, not commanded, or the robot has wheels.
/// docs/theory/velocity.md. Throws as align() does.
std::optional<TimeOffset> velocity_lag_by_reference(const Recording& recording, const Robot& robot);
std::optional<TimeOffset> velocity_lag_by_sightings(const Recording& recording, const Robot& robot);

}  // namespace trundle::recording
