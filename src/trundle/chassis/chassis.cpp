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
  if (wheel_count == kMaxWheels) throw std::length_error("a chassis has at most 8 wheels");
  wheel_storage[static_cast<std::size_t>(wheel_count++)] = wheel;
}

bool any_turns(const Increment& increment) {
  return std::ranges::any_of(increment.turned, [](double turned) { return turned != 0.0; });
}

double metres_per_tick(const Wheel& wheel) {
  if (wheel.ticks_per_revolution == 0.0) return 0.0;
  return kPi * wheel.diameter_m / std::abs(wheel.ticks_per_revolution);
}

bool has_skid_wheels(const Chassis& chassis) {
  return std::ranges::any_of(chassis.wheels(), [](const Wheel& w) { return w.kind == WheelKind::skid; });
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

Chassis dead_wheels(const WheelSize& size, std::span<const Pod> pods, const Gyro& gyro) {
  Chassis chassis;
  for (const Pod& pod : pods)
    chassis.add(wheel_at(size, WheelKind::omni, pod.x_m, pod.y_m, pod.direction_rad));
  chassis.gyro = gyro;
  return chassis;
}

}  // namespace trundle::chassis
