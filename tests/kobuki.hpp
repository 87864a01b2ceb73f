#pragma once

#include "trundle/chassis/robot.hpp"

namespace trundle::test {
using namespace chassis;

/// The robot of the recordings kobuki_slip. Gyro stamps are 60 ms late (cross-correlation of the turns over
/// 0.5 s); its driver has taken the bias off.
inline Robot kobuki() {
  Robot robot;
  robot.name = "kobuki";
  robot.wheel_names = {"left", "right"};
  robot.chassis =
      differential_drive({.diameter_m = 0.0704, .ticks_per_revolution = 2578.33, .tick_bits = 16}, 0.23);
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 5e-4, .time_offset_s = -0.06, .bias_sigma_rad_s = 0.001};
  return robot;
}

}  // namespace trundle::test
