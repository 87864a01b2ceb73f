#pragma once

#include <string>
#include <string_view>

#include "trundle/chassis/robot.hpp"

namespace trundle::fuzz {

constexpr std::string_view kLiveRobot = R"(
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
)";
constexpr std::string_view kLiveSensor = R"([landmark_sensor]
range_sigma_m = 0.1
bearing_sigma_deg = 2
max_range_m = 10
)";

/// Four wheels and a gyro: slip can show.
inline chassis::Robot live_robot(bool with_landmark_sensor = false) {
  return chassis::parse_robot(std::string(kLiveRobot) + std::string(with_landmark_sensor ? kLiveSensor : ""),
                              "robot.toml");
}

}  // namespace trundle::fuzz
