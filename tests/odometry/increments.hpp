#pragma once

#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/recording/alignment/align.hpp"

#include "chassis/robots.hpp"
#include "odometry/plain_odometry.hpp"

namespace trundle::test {
using namespace odometry;

/// Readings of a robot that wanders: every wheel turns on its own, so that every row and residual is
/// exercised.
inline std::vector<Increment> wandering(const Robot& robot, int count, double revolutions = 0.05,
                                        unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-1.0, 1.0);
  std::vector<Increment> increments;
  double turn = 0.0;
  const ScrubGauge gauge(robot.chassis);
  ScrubState scrub;
  const SpeedGauge speed_gauge(robot.chassis);
  SpeedState speed;
  for (int i = 0; i < count; ++i) {
    Increment increment{.time_s = 0.05 * (i + 1), .duration_s = 0.05};
    turn = 0.9 * turn + 0.05 * noise(random);
    for (double& turned : increment.turned) turned = revolutions * (0.6 + 0.4 * noise(random));
    for (std::size_t k = 0; k < kMaxWheels; ++k)  // only steered wheels look at it
      increment.steering_rad[k] = 0.6 * std::sin(0.1 * i + static_cast<double>(k));
    increment.gyro_rad = turn;
    increment.gyro_change_rad_s = 0.2 * std::sin(0.7 * i);
    increment.has_gyro = robot.chassis.gyro.has_value();
    if (gauge.applies()) gauge.add(scrub, increment);
    if (depends_on_speed(robot)) speed_gauge.add(speed, increment);
    increments.push_back(increment);
  }
  return increments;
}

/// A skid-steer whose track depends on how sharply it turns.
inline Chassis scrubbing() {
  Chassis chassis = skid_steer(kSize, 0.7, 0.4);
  chassis.scrub = 0.15;
  return chassis;
}

/// Any chassis on tyres that grow: by 1 % at the 0.2 m/s of wandering().
inline Chassis growing(Chassis chassis) {
  chassis.tyre_growth_s2_m2 = 0.3;
  return chassis;
}

/// The same, some of them with a wheel that slips.
inline std::vector<Increment> slipping(std::vector<Increment> increments) {
  for (std::size_t i = 0; i < increments.size(); i += 5)
    increments[i].slip_variance[i % 2] = i % 3 == 0 ? 1e-4 : 3e-4;
  return increments;
}

inline AlignedReadings aligned(const std::vector<Increment>& increments) {
  AlignedReadings readings;
  readings.bridged.assign(increments.size(), false);
  readings.increments = Increments(increments);
  return readings;
}

/// The gyro says nothing of an increment.
inline void lose_gyro(std::size_t i, AlignedReadings& readings) {
  Increment increment = readings.increments[i];
  increment.has_gyro = false;
  readings.increments.set(i, increment);
}

/// A calibration that knows these parameters with this covariance.
inline CalibrationRecord calibrated(const std::vector<std::string>& names,
                                    const Eigen::MatrixXd& covariance) {
  CalibrationRecord record;
  for (const std::string& name : names) {
    record.parameters.emplace_back().name = name;
    record.parameters.back().observable = true;
  }
  record.covariance = covariance;
  return record;
}

inline Robot differential_robot(double track_m = 0.5) {
  return robot_of(differential_drive(kSize, track_m));
}

/// Revolutions for so many metres.
inline double revolutions(double metres) {
  return metres / (kPi * kSize.diameter_m);
}

inline Increment two_wheels(double left_m, double right_m, double duration_s = 0.1) {
  Increment increment{.duration_s = duration_s};
  increment.turned[0] = revolutions(left_m);
  increment.turned[1] = revolutions(right_m);
  return increment;
}

}  // namespace trundle::test
