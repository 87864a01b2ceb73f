#pragma once

#include <optional>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/inspection/overview.hpp"

namespace trundle::inspection {

/// Rates in degrees that were taken for radians, or the other way round.
std::optional<Finding> wrong_gyro_unit(const Recording& recording, const Robot& robot,
                                       const Overview& overview);

/// What else the gyro's turns against the wheels' give away: a sign, a wheel that counts backwards, a track
/// or counts far off, an axis about which the robot does not turn, or, where turns agree, a bias that the
/// robot file takes for unlikely: what is left of them all the while.
void compare_gyro(const Recording& recording, const Robot& robot, const Overview& overview,
                  std::vector<Finding>& problems);

/// A gyro whose samples scatter more, where no wheel turns, than a rest is recognised by, and more than
/// chance and their resolution explain: its bias is not learned.
std::optional<Finding> louder_gyro(const Recording& recording, const Robot& robot);

}  // namespace trundle::inspection
