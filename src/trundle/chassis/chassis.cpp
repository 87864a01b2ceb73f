#include "trundle/chassis/chassis.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace trundle::chassis {
namespace {

Wheel wheel_at(const WheelSize& size, WheelKind kind, double x_m, double y_m, double direction_rad = 0.0) {
  return {.x_m = x_m,
          .y_m = y_m,
          .direction_rad = direction_rad,
          .kind = kind,
          .diameter_m = size.diameter_m,
          .ticks_per_revolution = size.ticks_per_revolution,
          .tick_bits = size.tick_bits};
}

}  // namespace

void Chassis::add(const Wheel& wheel) {
  add_passive(wheel);
  const auto wheels_there = all_wheels();
  std::rotate(wheels_there.begin() + wheel_count, wheels_there.end() - 1, wheels_there.end());
  --passive_count;
  ++wheel_count;
}

void Chassis::add_passive(const Wheel& wheel) {
  if (wheel_count + passive_count == kMaxWheels) throw std::length_error("a chassis has at most 8 wheels");
  ++passive_count;
  all_wheels().back() = wheel;
}

Chassis at_steering(const Chassis& chassis, const Increment& increment) {
  Chassis standing = chassis;
  for (std::size_t i = 0; i < standing.all_wheels().size(); ++i)
    if (auto& steering = standing.all_wheels()[i].steering) steering->reading_rad = increment.steering_rad[i];
  return standing;
}

bool any_turns(const Increment& increment) {
  return std::ranges::any_of(increment.turned, [](double turned) { return turned != 0.0; });
}

double metres_per_tick(const Wheel& wheel) {
  if (wheel.ticks_per_revolution == 0.0) return 0.0;
  return kPi * wheel.diameter_m / std::abs(wheel.ticks_per_revolution);
}

double revolutions_of(const Wheel& wheel, double way_m, double ticks) {
  const double per_revolution = std::abs(wheel.ticks_per_revolution);
  return way_m / (kPi * wheel.diameter_m) + (per_revolution > 0.0 ? ticks / per_revolution : 0.0);
}

double rolling_direction(const Wheel& wheel) {
  if (!wheel.steering) return wheel.direction_rad;
  return wheel.direction_rad +
         wheel.steering->scale * (wheel.steering->reading_rad - wheel.steering->zero_rad);
}

bool is_steered(const Chassis& chassis) {
  return std::ranges::any_of(chassis.all_wheels(), [](const Wheel& w) { return w.steering.has_value(); });
}

bool has_skid_wheels(const Chassis& chassis) {
  return std::ranges::any_of(chassis.wheels(), [](const Wheel& w) { return w.kind == WheelKind::skid; });
}

ForwardAndTurn corrected(const VelocityCorrection& velocity, const ForwardAndTurn& read, double duration_s) {
  return {velocity.forward_scale * read.forward_m, velocity.yaw_scale * read.turn_rad +
                                                       velocity.yaw_per_forward_rad_m * read.forward_m +
                                                       velocity.yaw_bias_rad_s * duration_s};
}

ForwardAndTurn read_as(const VelocityCorrection& velocity, const ForwardAndTurn& truth, double duration_s) {
  const double forward_m = truth.forward_m / velocity.forward_scale;
  const double turn_rad =
      truth.turn_rad - velocity.yaw_per_forward_rad_m * forward_m - velocity.yaw_bias_rad_s * duration_s;
  return {forward_m, turn_rad / velocity.yaw_scale};
}

double wheel_noise(const Chassis& chassis, std::size_t wheel) {
  const double own = chassis.wheels()[wheel].noise_per_sqrt_m;
  return std::isnan(own) ? chassis.noise.wheel_per_sqrt_m : own;
}

double typical_wheel_noise(const Chassis& chassis) {
  if (chassis.wheel_count == 0) return chassis.noise.wheel_per_sqrt_m;
  double squares = 0.0;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    squares += wheel_noise(chassis, i) * wheel_noise(chassis, i);
  return std::sqrt(squares / chassis.wheel_count);
}

void set_typical_wheel_noise(double per_sqrt_m, Chassis& chassis) {
  const double before = typical_wheel_noise(chassis);
  const bool alike =
      std::ranges::all_of(chassis.wheels(), [](const Wheel& w) { return std::isnan(w.noise_per_sqrt_m); });
  if (alike || before == 0.0) {
    chassis.noise.wheel_per_sqrt_m = per_sqrt_m;
    for (Wheel& wheel : chassis.wheels()) wheel.noise_per_sqrt_m = Wheel{}.noise_per_sqrt_m;
    return;
  }
  chassis.noise.wheel_per_sqrt_m *= per_sqrt_m / before;
  for (Wheel& wheel : chassis.wheels()) wheel.noise_per_sqrt_m *= per_sqrt_m / before;
}

Chassis differential_drive(const WheelSize& size, double track_m) {
  Chassis chassis;
  chassis.add(wheel_at(size, WheelKind::fixed, 0.0, 0.5 * track_m));
  chassis.add(wheel_at(size, WheelKind::fixed, 0.0, -0.5 * track_m));
  return chassis;
}

Chassis skid_steer(const WheelSize& size, double effective_track_m, double wheelbase_m) {
  Chassis chassis;
  for (const double x : {0.5, -0.5})
    for (const double y : {0.5, -0.5})
      chassis.add(wheel_at(size, WheelKind::skid, x * wheelbase_m, y * effective_track_m));
  return chassis;
}

Chassis omni3(const WheelSize& size, double radius_m) {
  Chassis chassis;
  for (const double azimuth_deg : {60.0, 180.0, -60.0}) {
    const double azimuth = radians(azimuth_deg);
    chassis.add(wheel_at(size, WheelKind::omni, radius_m * std::cos(azimuth), radius_m * std::sin(azimuth),
                         wrap_angle(azimuth + 0.5 * kPi)));
  }
  return chassis;
}

Chassis mecanum(const WheelSize& size, double track_m, double wheelbase_m) {
  Chassis chassis;
  for (const double x : {0.5, -0.5}) {
    for (const double y : {0.5, -0.5}) {
      Wheel wheel = wheel_at(size, WheelKind::mecanum, x * wheelbase_m, y * track_m);
      wheel.roller_rad = x * y > 0.0 ? -0.25 * kPi : 0.25 * kPi;
      chassis.add(wheel);
    }
  }
  return chassis;
}

Chassis tricycle(const WheelSize& size, double wheelbase_m, const SteeringSensor& steering) {
  Chassis chassis;
  Wheel front = wheel_at(size, WheelKind::fixed, wheelbase_m, 0.0);
  front.steering = steering;
  chassis.add(front);
  chassis.add_passive({});
  return chassis;
}

Chassis ackermann(const WheelSize& size, double track_m, double wheelbase_m, double front_track_m,
                  const SteeringSensor& steering) {
  Chassis chassis = differential_drive(size, track_m);
  for (const double y : {0.5, -0.5}) {
    chassis.add_passive({.x_m = wheelbase_m, .y_m = y * front_track_m, .steering = steering});
    if (front_track_m == 0.0) break;
  }
  return chassis;
}

Chassis swerve(const WheelSize& size, double track_m, double wheelbase_m, const SteeringSensor& steering) {
  Chassis chassis;
  for (const double x : {0.5, -0.5}) {
    for (const double y : {0.5, -0.5}) {
      Wheel wheel = wheel_at(size, WheelKind::fixed, x * wheelbase_m, y * track_m);
      wheel.steering = steering;
      chassis.add(wheel);
    }
  }
  return chassis;
}

Chassis dead_wheels(const WheelSize& size, std::span<const Pod> pods, const Gyro& gyro) {
  Chassis chassis;
  for (const Pod& pod : pods)
    chassis.add(wheel_at(size, WheelKind::omni, pod.x_m, pod.y_m, pod.direction_rad));
  chassis.gyro = gyro;
  return chassis;
}

}  // namespace trundle::chassis
