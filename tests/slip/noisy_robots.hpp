#pragma once

#include "chassis/robots.hpp"

namespace trundle::test {

/// Two wheels and a gyro, as noisy as usual ones.
inline chassis::Robot noisy_differential() {
  chassis::Robot robot = robot_of(chassis::differential_drive(kSize, 0.5));
  robot.chassis.noise.wheel_per_sqrt_m = 0.001;
  robot.chassis.gyro = chassis::Gyro{.noise_rad_s_sqrt_hz = 3e-4};
  return robot;
}

}  // namespace trundle::test
