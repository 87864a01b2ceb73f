#include "trundle/calibration/preparation/reversed_wheel.hpp"

#include "trundle/geometry/angle.hpp"

namespace trundle::calibration {
namespace {

constexpr double kOtherTurn = 1.8;      // slip makes less of a turn
constexpr double kAgreeReversed = 0.9;  // correlation: 81 % of the variance, not the 25 % of kTurnsAgree
constexpr double kLeft = 0.25;          // of the variance that wheels as they are leave unexplained

double unexplained(const PairedSums& turns) {
  return 1.0 - turns.correlation() * turns.correlation();
}

}  // namespace

Finding turn_around(std::size_t index, bool in_ticks, Robot& robot) {
  Wheel& wheel = robot.chassis.wheels()[index];
  Finding finding{.code = in_ticks ? FindingCode::reversed_counter : FindingCode::reversed_wheel,
                  .subjects = {robot.wheel_names[index]}};
  if (in_ticks) {
    wheel.ticks_per_revolution = -wheel.ticks_per_revolution;
    finding.payload = payload::Amount{wheel.ticks_per_revolution};
  } else {
    wheel.direction_rad = wrap_angle(wheel.direction_rad + kPi);
    finding.payload = payload::Amount{degrees(wheel.direction_rad)};
  }
  return finding;
}

bool turns_agree(const PairedSums& turns, const Robot& robot) {
  const double slope = turns.slope();
  return turns.correlation() > kTurnsAgree &&
         (has_skid_wheels(robot.chassis) || (slope < kOtherTurn && slope > 1.0 / kOtherTurn));
}

std::optional<std::size_t> reversed_wheel(const PairedSums& turns, const AlignedReadings& readings,
                                          const Robot& robot) {
  if (turns_agree(turns, robot) || turns.lesser() < kMuchTurning_rad) return std::nullopt;
  for (std::size_t wheel = 0; wheel < robot.chassis.wheels().size(); ++wheel) {
    Robot turned = robot;
    turn_around(wheel, false, turned);
    const PairedSums otherwise = turns_of_gyro(turned, readings);
    if (otherwise.correlation() > kAgreeReversed && turns_agree(otherwise, robot) &&
        unexplained(otherwise) < kLeft * unexplained(turns))
      return wheel;
  }
  return std::nullopt;
}

}  // namespace trundle::calibration
