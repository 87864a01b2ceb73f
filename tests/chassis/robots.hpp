#pragma once

#include <random>

#include <fmt/format.h>

#include "trundle/chassis/robot.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"

namespace trundle::test {
using namespace chassis;

inline Robot robot_of(const Chassis& chassis) {
  Robot robot;
  robot.name = "test";
  robot.chassis = chassis;
  for (int i = 0; i < chassis.wheel_count; ++i) robot.wheel_names.push_back(fmt::format("w{}", i));
  for (int i = 0; i < chassis.passive_count; ++i) robot.passive_names.push_back(fmt::format("p{}", i));
  return robot;
}

inline constexpr WheelSize kSize{.diameter_m = 0.15, .ticks_per_revolution = 2048, .tick_bits = 0};

inline Chassis with_gyro(Chassis chassis) {
  chassis.gyro = Gyro{.bias_rad_s = 0.01, .scale = 1.02};
  return chassis;
}

/// The pods of a frame that holds a robot's passive wheels: forward at the left, sideways at the rear.
inline Chassis two_pods() {
  const std::array<Pod, 2> pods{{{0.02, 0.1, 0.0}, {-0.12, 0.01, radians(90)}}};
  return dead_wheels(kSize, pods, Gyro{});
}

inline Chassis three_pods() {
  const std::array<Pod, 3> pods{{{0.0, 0.12, 0.0}, {0.0, -0.12, 0.0}, {-0.15, 0.0, radians(90)}}};
  return dead_wheels(kSize, pods, Gyro{});
}

/// Driven wheels of one chassis with the passive ones of another, which may carry a gyro.
inline Chassis joined(Chassis chassis, const Chassis& pods) {
  for (const Wheel& pod : pods.wheels()) chassis.add(pod);
  chassis.gyro = pods.gyro;
  return chassis;
}

/// A robot nobody thought of: all kinds of wheel, at odd places and angles.
inline Chassis odd_chassis() {
  Chassis chassis;
  const auto wheel = [&](WheelKind kind, double x, double y, double direction, double roller = 0.0) {
    chassis.add({.x_m = x,
                 .y_m = y,
                 .direction_rad = direction,
                 .kind = kind,
                 .roller_rad = roller,
                 .diameter_m = 0.1 + 0.01 * chassis.wheel_count,
                 .ticks_per_revolution = -1000});
  };
  wheel(WheelKind::fixed, 0.1, 0.2, 0.05);
  wheel(WheelKind::skid, -0.2, -0.3, -0.03);
  wheel(WheelKind::mecanum, 0.3, -0.25, 0.1, radians(40));
  wheel(WheelKind::mecanum, -0.3, 0.22, 0.0, radians(-50));
  chassis.icr_x_m = 0.04;
  return with_gyro(chassis);
}

/// A steering that is nowhere at its default.
inline constexpr SteeringSensor kSteering{
    .zero_rad = -0.02, .scale = 1.03, .sigma_rad = 0.004, .time_offset_s = -0.01, .reading_rad = 0.3};

/// All that may be steered: a wheel with an encoder off the middle, a passive one, and an axle that is not.
inline Chassis odd_steered_chassis() {
  Chassis chassis;
  chassis.add({.x_m = 0.4,
               .y_m = 0.05,
               .direction_rad = 0.1,
               .diameter_m = 0.15,
               .ticks_per_revolution = 1600,
               .steering = kSteering});
  chassis.add({.x_m = 0.02, .y_m = -0.2, .diameter_m = 0.1, .ticks_per_revolution = -1000});
  chassis.add_passive({.x_m = 0.35, .y_m = 0.2, .steering = kSteering});
  return chassis;
}

inline Chassis velocity_robot() {
  Chassis chassis = with_gyro({});
  chassis.velocity = {
      .forward_scale = 1.04, .yaw_scale = 0.93, .yaw_per_forward_rad_m = 0.03, .yaw_bias_rad_s = -0.004};
  return chassis;
}

/// What the wheels and the gyro of a chassis read, without noise, over a motion of the body.
inline Increment increment_of(const Chassis& chassis, const Twist2& motion, double duration_s = 0.05) {
  Increment increment;
  increment.duration_s = duration_s;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    const Wheel& wheel = chassis.wheels()[i];
    increment.turned[i] = rolling_row(wheel).dot(motion.vector()) / (kPi * wheel.diameter_m);
  }
  if (const ScrubGauge gauge(chassis); gauge.applies()) {
    ScrubState state;
    increment.turned = with_scrub(chassis, increment.turned);
    gauge.add(state, increment);
  }
  if (chassis.tyre_growth_s2_m2 != 0.0) increment.turned = with_growth(chassis, increment.turned, duration_s);
  SpeedState speed;
  SpeedGauge(chassis).add(speed, increment);
  if (chassis.wheel_count == 0) {
    const ForwardAndTurn read = read_as(chassis.velocity, {motion.dx, motion.dtheta}, duration_s);
    increment.turned = {read.forward_m, read.turn_rad};
  }
  if (chassis.gyro) {
    increment.has_gyro = true;
    increment.gyro_rad = motion.dtheta / chassis.gyro->scale + chassis.gyro->bias_rad_s * duration_s;
  }
  return increment;
}

/// Steers every steered wheel along the motion of its place (where that moves), and reads it.
inline Increment steered_increment_of(const Chassis& chassis, const Twist2& motion,
                                      double duration_s = 0.05) {
  std::array<double, kMaxWheels> readings{};
  for (std::size_t i = 0; i < chassis.all_wheels().size(); ++i) {
    const Wheel& wheel = chassis.all_wheels()[i];
    if (!wheel.steering) continue;
    const double angle =
        std::atan2(motion.dy + motion.dtheta * wheel.x_m, motion.dx - motion.dtheta * wheel.y_m);
    readings[i] = wheel.steering->zero_rad + wrap_angle(angle - wheel.direction_rad) / wheel.steering->scale;
  }
  Increment increment = increment_of(at_steering(chassis, {.steering_rad = readings}), motion, duration_s);
  increment.steering_rad = readings;
  return increment;
}

/// Readings with Gaussian noise of their own variances.
inline Readings with_noise(Readings readings, std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  for (int i = 0; i < readings.z.size(); ++i)
    readings.z[i] += std::sqrt(readings.variance[i]) * normal(engine);
  return readings;
}

}  // namespace trundle::test
