#include "trundle/calibration/noise/parity.hpp"

#include <optional>

#include "trundle/calibration/likelihood/contradiction.hpp"
#include "trundle/chassis/without_wheel.hpp"

namespace trundle::calibration {

Redundancy redundancy_of(const Robot& robot) {
  const std::optional<Chassis> chassis = without_steering(robot.chassis);
  if (!chassis) return {rows_of(robot.chassis, robot.chassis.gyro.has_value()), {}};
  Redundancy redundancy{rows_of(*chassis, chassis->gyro.has_value()), {}};
  redundancy.P = left_null_space(redundancy.rows);
  return redundancy;
}

CommonErrors::CommonErrors(const Chassis& chassis, const Chassis& showing, const Redundancy& redundancy)
    : showing_(showing),
      redundancy_(redundancy),
      gauge_(chassis),
      rounding_(rounding_of(chassis, redundancy.rows) / 2.0) {
  if (redundancy.P.cols() == 0 || is_steered(chassis)) return;
  for (std::size_t octave = 0; octave < kOctaves; ++octave)
    gains_.push_back(twist_gain(
        redundancy.rows, weighing_variances(chassis, redundancy.rows, gauge_.octave_speed(octave), 1.0)));
}

RowVector CommonErrors::variance_of(const Increment& increment, const Rolled& rolled) const {
  const Increment sure{.duration_s = increment.duration_s, .turned = rolled, .has_gyro = true};
  return readings_of(showing_, redundancy_.rows, sure).variance - 2.0 * rounding_;
}

Matrix3X CommonErrors::along(const Displacement& displacement, Odometer& odometer) const {
  const int measured = redundancy_.rows.measured;
  const auto shared = [&](const RowVector& variance, std::size_t octave) -> Matrix3X {
    return gains_[octave].leftCols(measured) * variance.head(measured).asDiagonal() * redundancy_.P;
  };
  Rolling rolling = displacement.rolling;
  Matrix3X sum = shared(rounding_, odometer.state().rolling.octave);  // the first count's, with both signs
  for (std::size_t i = displacement.first; i < displacement.last; ++i) {
    const Increment increment = displacement.run->readings.increments[i];
    const std::size_t octave = odometer.state().rolling.octave;
    odometer.step(increment);
    sum += adjoint(odometer.pose()) * shared(variance_of(increment, gauge_.add(rolling, increment)), octave);
  }
  const Pose2& end = odometer.pose();
  sum += adjoint(end) * shared(rounding_, odometer.state().rolling.octave);
  sum.topRows<2>() += Vector2(-end.y, end.x) * sum.row(2);  // of the body, not of what is at the origin
  return sum;
}

}  // namespace trundle::calibration
