#pragma once

#include <array>
#include <string>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::test {
using namespace recording;

/// A differential drive: wheels left and right, 100 ticks per revolution, circumference 1 m, track 0.5 m.
inline Robot two_wheels(int tick_bits = 0) {
  Robot robot;
  robot.name = "two";
  robot.chassis = differential_drive({1.0 / kPi, 100.0, tick_bits}, 0.5);
  robot.wheel_names = {"left", "right"};
  return robot;
}

inline Robot with_gyro(Robot robot, const Gyro& gyro = {}) {
  robot.chassis.gyro = gyro;
  return robot;
}

/// Two passive pods, of which one rolls ahead and one to the left, and a gyro that alone sees turns.
inline Robot pods_and_gyro(double ticks, double gyro_s = 0.0, double reference_s = 0.0) {
  constexpr std::array kPods = {Pod{.y_m = 0.1}, Pod{.x_m = -0.12, .direction_rad = radians(90.0)}};
  Robot robot;
  robot.name = "pods";
  robot.chassis = dead_wheels({0.05, ticks, 16}, kPods, Gyro{.bias_rad_s = 0.005, .time_offset_s = gyro_s});
  robot.wheel_names = {"forward", "sideways"};
  robot.chassis.noise.wheel_per_sqrt_m = 0.002;
  robot.reference_time_offset_s = reference_s;
  return robot;
}

/// Stamps 0, step, 2 step ...
inline std::vector<double> stamps(std::size_t count, double step_s) {
  std::vector<double> time_s(count);
  for (std::size_t i = 0; i < count; ++i) time_s[i] = static_cast<double>(i) * step_s;
  return time_s;
}

/// A recording of one series for each of left and right.
inline Recording wheels(std::vector<double> time_s, std::vector<double> left, std::vector<double> right,
                        WheelUnit unit = WheelUnit::ticks) {
  Recording recording;
  recording.name = "made";
  recording.wheels.time_s = std::move(time_s);
  recording.wheels.series = {{"left", unit, std::move(left)}, {"right", unit, std::move(right)}};
  return recording;
}

}  // namespace trundle::test
