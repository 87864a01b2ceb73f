#include "trundle/recording/turns.hpp"

#include <cmath>
#include <limits>

#include "trundle/chassis/rows.hpp"
#include "trundle/recording/alignment/gyro_turns.hpp"

namespace trundle::recording {

PairedSums turn_pairs(const Robot& robot, const AlignedReadings& readings,
                      const std::function<double(const Increment&)>& other_turn) {
  // A turn then is many counts, clocks that differ by some 10 ms hardly matter, and few turn back within it.
  constexpr double kPiece_s = 0.5;
  const Rows rows = rows_of(robot.chassis, false);
  PairedSums pairs;
  double by_wheels = 0.0, by_other = 0.0, duration_s = 0.0;
  for (const Increment& increment : readings.increments) {
    const double turn = other_turn(increment);
    if (std::isnan(turn)) continue;
    by_wheels += twist_of(robot.chassis, rows, increment).dtheta;
    by_other += turn;
    duration_s += increment.duration_s;
    if (duration_s < kPiece_s) continue;
    pairs.add(by_wheels, by_other);
    by_wheels = by_other = duration_s = 0.0;
  }
  return pairs;
}

namespace {

double rotation_of(double gyro_rad, double duration_s, const Gyro& gyro) {
  return (gyro_rad - gyro.bias_rad_s * duration_s) * gyro.scale;
}

bool both_see_turns(const Recording& recording, const Robot& robot) {
  return robot.chassis.gyro && !recording.gyro.time_s.empty() &&
         observability(rows_of(robot.chassis, false)).rank == 3;
}

std::optional<PairedSums> if_enough(const PairedSums& pairs) {
  if (std::sqrt(pairs.xx) < kLeastTurning_rad || pairs.yy == 0.0) return std::nullopt;
  return pairs;
}

}  // namespace

PairedSums turns_of_gyro(const Robot& robot, const AlignedReadings& readings) {
  const Gyro& gyro = *robot.chassis.gyro;
  return turn_pairs(robot, readings, [&](const Increment& increment) {
    return increment.has_gyro ? rotation_of(increment.gyro_rad, increment.duration_s, gyro)
                              : std::numeric_limits<double>::quiet_NaN();
  });
}

std::optional<PairedSums> comparable_turns(const Recording& recording, const Robot& robot,
                                           const AlignedReadings& readings) {
  if (!both_see_turns(recording, robot)) return std::nullopt;
  return if_enough(turns_of_gyro(robot, readings));
}

std::optional<PairedSums> comparable_turns_anew(const Recording& recording, const Robot& robot,
                                                const AlignedReadings& readings) {
  if (!both_see_turns(recording, robot)) return std::nullopt;
  const Gyro& gyro = *robot.chassis.gyro;
  const GyroSamples samples(recording.gyro, gyro);
  GyroTurns turns(samples, gyro.time_offset_s, readings.start_s);
  return if_enough(turn_pairs(robot, readings, [&](const Increment& increment) {
    const std::optional<double> turn = turns.until(increment.time_s);
    return turn ? rotation_of(*turn, increment.duration_s, gyro) : std::numeric_limits<double>::quiet_NaN();
  }));
}

bool turns_contradict(const Recording& recording, const Robot& robot, const AlignedReadings& readings) {
  constexpr double kClearTurning = 0.5;  // [rad], root of the sum of squares
  const auto pairs = comparable_turns(recording, robot, readings);
  return pairs && pairs->correlation() < -kTurnsAgree && pairs->lesser() > kClearTurning;
}

}  // namespace trundle::recording
