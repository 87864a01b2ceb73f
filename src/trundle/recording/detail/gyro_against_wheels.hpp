#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/increments.hpp"
#include "trundle/statistics/paired_sums.hpp"

namespace trundle {

/// Root of the sum of squares [rad] with which turns can be compared.
inline constexpr double kLeastTurning_rad = 0.1;

/// How far the robot turns over pieces of half a second, by its wheels (x) and by something else (y) [rad].
/// `other_turn`: how far in an interval, asked of one after the other; NaN: it does not tell.
PairedSums turn_pairs(const Robot& robot, const AlignedReadings& readings,
                      const std::function<double(const Increment&)>& other_turn);

/// Rates in degrees that were taken for radians, or the other way round.
std::optional<Finding> wrong_gyro_unit(const Recording& recording, const Robot& robot,
                                       const AlignedReadings& readings);

/// What else the gyro's turns against the wheels' give away: a sign, a wheel that counts backwards, a track
/// or counts far off.
void compare_gyro(const Recording& recording, const Robot& robot, const AlignedReadings& readings,
                  std::vector<Finding>& problems);

/// Whether gyro and wheels clearly turn opposite ways, which one of them must have wrong: turns much larger
/// than a bias would sum up to.
bool turns_contradict(const Recording& recording, const Robot& robot, const AlignedReadings& readings);

}  // namespace trundle
