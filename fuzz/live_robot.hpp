#pragma once

#include "trundle/chassis/robot.hpp"

namespace trundle::fuzz {

/// Four wheels and a gyro: slip can show.
inline chassis::Robot live_robot() {
  return chassis::parse_robot(R"(
[[wheel]]
name = "a"
x_m = 0.2
y_m = 0.2
kind = "mecanum"
roller_deg = 45
diameter_m = 0.1
ticks_per_revolution = 1000
tick_bits = 16
[[wheel]]
name = "b"
x_m = 0.2
y_m = -0.2
kind = "mecanum"
roller_deg = -45
diameter_m = 0.1
ticks_per_revolution = 1000
[[wheel]]
name = "c"
x_m = -0.2
y_m = 0.2
kind = "mecanum"
roller_deg = -45
diameter_m = 0.1
ticks_per_revolution = 1000
[[wheel]]
name = "d"
x_m = -0.2
y_m = -0.2
kind = "mecanum"
roller_deg = 45
diameter_m = 0.1
ticks_per_revolution = 1000
[gyro]
noise_rad_s_sqrt_hz = 0.0003
bias_walk_rad_s_sqrt_s = 1e-5
)",
                              "robot.toml");
}

}  // namespace trundle::fuzz
