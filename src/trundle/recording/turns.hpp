#pragma once

#include <functional>
#include <optional>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/statistics/paired_sums.hpp"

namespace trundle::recording {

/// Root of the sum of squares [rad] with which turns can be compared.
inline constexpr double kLeastTurning_rad = 0.1;
/// Correlation of turns that show the same motion.
inline constexpr double kTurnsAgree = 0.5;

/// How far the robot turns over pieces of half a second, by its wheels (x) and by something else (y) [rad].
/// `other_turn`: how far in an interval, asked of one after the other; NaN: it does not tell.
PairedSums turn_pairs(const Robot& robot, const AlignedReadings& readings,
                      const std::function<double(const Increment&)>& other_turn);

/// The same by its wheels and its gyro, which the robot must have.
PairedSums turns_of_gyro(const Robot& robot, const AlignedReadings& readings);

/// The same; nothing where the robot hardly turns, or only one of the two sees it.
std::optional<PairedSums> comparable_turns(const Recording& recording, const Robot& robot,
                                           const AlignedReadings& readings);

/// The same, what the gyro turned computed anew from its stream, its limit and clock as this robot has them.
std::optional<PairedSums> comparable_turns_anew(const Recording& recording, const Robot& robot,
                                                const AlignedReadings& readings);

/// Whether gyro and wheels clearly turn opposite ways, which one of them must have wrong: turns much larger
/// than a bias would sum up to.
bool turns_contradict(const Recording& recording, const Robot& robot, const AlignedReadings& readings);

}  // namespace trundle::recording
