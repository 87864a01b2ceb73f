#include "trundle/odometry/turn_comparison.hpp"

namespace trundle::odometry {
namespace {

/// So often that a bias of 1°/s, unknown at first, turns the robot by little more than 1° meanwhile; no
/// oftener, for what the wheels' counts are rounded by counts once per comparison.
constexpr double kEvery_s = 1.0;

}  // namespace

TurnComparison::TurnComparison(const Robot& robot, std::span<const Parameter> parameters)
    : gyro_(*robot.chassis.gyro),
      parameters_(parameters.begin(), parameters.end()),
      by_wheels_(robot.chassis, parameters, false),
      wheels_(robot.chassis.wheels().size()) {
  for (std::size_t i = 0; i < wheels_; ++i)
    rounding_variance_[i] = rounding_variance(robot.chassis.wheels()[i]);
}

void TurnComparison::add(ComparedTurn& sum, const Increment& increment, const Rolled& rolled,
                         std::size_t octave) const {
  sum.duration_s += increment.duration_s;
  // Stamps of gyro and wheels are apart by up to an interval: what is turned meanwhile, uniform in ±1 of it.
  const double turn = gyro_.scale * increment.gyro_rad;
  sum.difference.rounding_variance = turn * turn / 3.0;
  if (by_wheels_.steered()) return compare(increment, rolled, octave, sum.difference);
  sum.gyro_rad += increment.gyro_rad;
  sum.scrub_turned += increment.scrub_turned;
  for (std::size_t i = 0; i < kMaxWheels; ++i) {
    sum.turned[i] += increment.turned[i];
    sum.speed_turned[i] += increment.speed_turned[i];
    sum.slip_variance[i] += increment.slip_variance[i];
    sum.rolled[i] += rolled[i];
  }
}

bool TurnComparison::is_due(const ComparedTurn& sum) {
  return sum.duration_s >= kEvery_s;
}

TurnDifference TurnComparison::take(ComparedTurn& sum, std::size_t octave) const {
  if (!by_wheels_.steered()) {  // the twist is linear in the readings
    Increment readings;
    readings.duration_s = sum.duration_s;
    readings.gyro_rad = sum.gyro_rad;
    readings.scrub_turned = sum.scrub_turned;
    readings.turned = sum.turned;
    readings.speed_turned = sum.speed_turned;
    readings.slip_variance = sum.slip_variance;
    compare(readings, sum.rolled, octave, sum.difference);
  }
  const TurnDifference difference = sum.difference;
  sum = {};
  return difference;
}

/// docs/theory/redundant-turn.md, eq. 1
void TurnComparison::compare(const Increment& readings, const Rolled& rolled, std::size_t octave,
                             TurnDifference& difference) const {
  TwistStep step;
  by_wheels_.twist_with_covariance(readings, rolled, octave, step);
  const double rate = readings.gyro_rad - gyro_.bias_rad_s * readings.duration_s;
  const double density = gyro_.scale * gyro_.noise_rad_s_sqrt_hz;
  difference.duration_s += readings.duration_s;
  difference.rad += gyro_.scale * rate - step.twist[2];
  difference.variance += density * density * readings.duration_s + step.covariance[5];
  for (std::size_t i = 0; i < wheels_; ++i)
    difference.rounding_variance += step.by_travel.h[i] * step.by_travel.h[i] * rounding_variance_[i];
  for (std::size_t j = 0; j < parameters_.size(); ++j)
    difference.by_parameter[j] +=
        (parameters_[j].kind == ParameterKind::gyro_scale ? rate : 0.0) - step.derivative[j][2];
}

}  // namespace trundle::odometry
