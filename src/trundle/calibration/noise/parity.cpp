#include "trundle/calibration/noise/parity.hpp"

#include <optional>

#include "trundle/chassis/without_wheel.hpp"

namespace trundle::calibration {

Redundancy redundancy_of(const Robot& robot) {
  const std::optional<Chassis> chassis = without_steering(robot.chassis);
  if (!chassis) return {rows_of(robot.chassis, robot.chassis.gyro.has_value()), {}};
  Redundancy redundancy{rows_of(*chassis, chassis->gyro.has_value()), {}};
  redundancy.P = left_null_space(redundancy.rows);
  return redundancy;
}

CommonError common_error_along(const CommonErrors& common, const Displacement& displacement,
                               Odometer& odometer) {
  const auto octave = [&] { return odometer.state().rolling.octave; };
  Rolling rolling = displacement.rolling;
  CommonError sum = common.of_rounding(octave());  // the first count's, with both signs
  for (std::size_t i = displacement.first; i < displacement.last; ++i) {
    const Increment increment = displacement.run->readings.increments[i];
    const CommonError own = common.of(increment.duration_s, common.rolled(rolling, increment), octave());
    odometer.step(increment);
    sum += adjoint(odometer.pose()) * own;
  }
  const Pose2& end = odometer.pose();
  sum += adjoint(end) * common.of_rounding(octave());
  sum.topRows<2>() += Vector2(-end.y, end.x) * sum.row(2);  // of the body, not of what is at the origin
  return sum;
}

}  // namespace trundle::calibration
