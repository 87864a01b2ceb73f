#include "trundle/recording/turns.hpp"

#include <cmath>
#include <limits>

#include "trundle/chassis/rows.hpp"

namespace trundle::recording {

PairedSums turn_pairs(const Robot& robot, const AlignedReadings& readings,
                      const std::function<double(const Increment&)>& other_turn) {
  const Rows rows = rows_of(robot.chassis, false);
  TurnPairs pairs;
  for (const Increment& increment : readings.increments) {
    const double turn = other_turn(increment);
    if (!std::isnan(turn))
      pairs.add(twist_of(robot.chassis, rows, increment).dtheta, turn, increment.duration_s);
  }
  return pairs.sums();
}

double rotation_of(double gyro_rad, double duration_s, const Gyro& gyro) {
  return (gyro_rad - gyro.bias_rad_s * duration_s) * gyro.scale;
}

std::optional<PairedSums> if_enough(const PairedSums& pairs) {
  if (std::sqrt(pairs.xx) < kLeastTurning_rad || pairs.yy == 0.0) return std::nullopt;
  return pairs;
}

PairedSums turns_of_gyro(const Robot& robot, const AlignedReadings& readings) {
  const Gyro& gyro = *robot.chassis.gyro;
  return turn_pairs(robot, readings, [&](const Increment& increment) {
    return increment.has_gyro ? rotation_of(increment.gyro_rad, increment.duration_s, gyro)
                              : std::numeric_limits<double>::quiet_NaN();
  });
}

std::optional<PairedSums> comparable_turns(const Recording& recording, const Robot& robot,
                                           const AlignedReadings& readings) {
  if (!robot.chassis.gyro || recording.gyro.time_s.empty() ||
      observability(rows_of(robot.chassis, false)).rank < 3)
    return std::nullopt;
  return if_enough(turns_of_gyro(robot, readings));
}

bool turns_contradict(const Recording& recording, const Robot& robot, const AlignedReadings& readings) {
  constexpr double kClearTurning = 0.5;  // [rad], root of the sum of squares
  const auto pairs = comparable_turns(recording, robot, readings);
  return pairs && pairs->correlation() < -kTurnsAgree && pairs->lesser() > kClearTurning;
}

}  // namespace trundle::recording
