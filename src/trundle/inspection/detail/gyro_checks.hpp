#pragma once

#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/overview.hpp"

namespace trundle::inspection {

/// Rates in degrees that were taken for radians, or the other way round.
std::optional<Finding> wrong_gyro_unit(const Recording& recording, const Robot& robot,
                                       const Overview& overview);

/// A bias so far from what the robot file takes for likely that no rest is recognised by it: where turns
/// agree, what is left of them all the while.
std::optional<Finding> wrong_gyro_bias(const Recording& recording, const Robot& robot,
                                       const Overview& overview);

/// What else the gyro's turns against the wheels' give away: a sign, a wheel that counts backwards, a track
/// or counts far off, an axis about which the robot does not turn. `counts_turns`: no wheel is known not to.
std::optional<Finding> wrong_turns(const Recording& recording, const Robot& robot, const Overview& overview,
                                   bool counts_turns);

/// A gyro whose samples scatter more, where no wheel turns, than a rest is recognised by, and more than
/// chance and their resolution explain: its bias is not learned.
std::optional<Finding> louder_gyro(const Recording& recording, const Robot& robot);

}  // namespace trundle::inspection
