#include "trundle/calibration/preparation/reversed_wheel.hpp"

#include "trundle/chassis/rows.hpp"

namespace trundle::calibration {
namespace {

// Root of the sum of squares: far more than a bias sums up to.
constexpr double kMuchTurning_rad = 1.0;
constexpr double kOtherTurn = 1.8;      // slip makes less of a turn
constexpr double kAgreeReversed = 0.9;  // correlation: 81 % of the variance, not the 25 % of kTurnsAgree
constexpr double kLeft = 0.25;          // of the variance that wheels as they are leave unexplained

/// Turns as they would be if a wheel counted the other way.
PairedSums with_reversed(std::size_t wheel, const Robot& robot, const AlignedReadings& readings) {
  const Rows rows = rows_of(robot.chassis, false);
  TurnPairs pairs;
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    Increment increment = readings.increments[i];
    if (!increment.has_gyro) continue;
    increment.turned[wheel] = -increment.turned[wheel];
    pairs.add(twist_of(robot.chassis, rows, increment).dtheta,
              rotation_of(increment.gyro_rad, increment.duration_s, *robot.chassis.gyro),
              increment.duration_s);
  }
  return pairs.sums();
}

double unexplained(const PairedSums& turns) {
  return 1.0 - turns.correlation() * turns.correlation();
}

}  // namespace

bool turns_agree(const PairedSums& turns, const Robot& robot) {
  const double slope = turns.slope();
  return turns.correlation() > kTurnsAgree &&
         (has_skid_wheels(robot.chassis) || (slope < kOtherTurn && slope > 1.0 / kOtherTurn));
}

std::optional<std::size_t> reversed_wheel(const PairedSums& turns, const AlignedReadings& readings,
                                          const Robot& robot) {
  if (turns_agree(turns, robot) || turns.lesser() < kMuchTurning_rad) return std::nullopt;
  for (std::size_t wheel = 0; wheel < robot.chassis.wheels().size(); ++wheel) {
    const PairedSums otherwise = with_reversed(wheel, robot, readings);
    if (otherwise.correlation() > kAgreeReversed && turns_agree(otherwise, robot) &&
        unexplained(otherwise) < kLeft * unexplained(turns))
      return wheel;
  }
  return std::nullopt;
}

}  // namespace trundle::calibration
