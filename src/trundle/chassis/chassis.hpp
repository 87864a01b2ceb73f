#pragma once

#include <array>
#include <limits>
#include <optional>
#include <span>

#include "trundle/geometry/pose2.hpp"

namespace trundle::chassis {

inline constexpr int kMaxWheels = 8;

enum class WheelKind {
  fixed,    ///< cannot skid sideways: adds a lateral row
  skid,     ///< must scrub in turns (skid-steer): the chassis adds one lateral row for all of them
  omni,     ///< free to roll sideways
  mecanum,  ///< free along its rollers
};

/// One wheel or passive pod: where it touches the ground and what a revolution of it means. Frame: body.
struct Wheel {
  double x_m = 0.0;
  double y_m = 0.0;
  double direction_rad = 0.0;  ///< rolling direction
  WheelKind kind = WheelKind::fixed;
  double roller_rad = 0.0;  ///< mecanum: from the axle to the free direction of the roller on the ground
  double diameter_m = 0.0;
  double ticks_per_revolution = 0.0;  ///< negative: counts backwards; 0: gives no ticks
  int tick_bits = 0;                  ///< the counter wraps at 2^bits; 0: never
  double recorded_diameter_m = 0.0;   ///< with which recorded travel in metres was computed; 0: unknown
  /// 1σ of its travel [m/√m]; NaN: that of ChassisNoise.
  double noise_per_sqrt_m = std::numeric_limits<double>::quiet_NaN();
};

struct Gyro {
  double bias_rad_s = 0.0;
  double scale = 1.0;  ///< true rate = (reading − bias) · scale; negative: mounted upside down
  double noise_rad_s_sqrt_hz = 3e-4;
  double bias_walk_rad_s_sqrt_s = 1e-5;
  double max_rate_rad_s = 8.7;
  double time_offset_s = 0.0;      ///< added to its stamps
  double bias_sigma_rad_s = 0.02;  ///< 1σ of the bias about bias_rad_s before the first rest shows it
};

struct ChassisNoise {
  double wheel_per_sqrt_m = 0.01;     ///< 1σ of the travel of a wheel without a noise of its own [m/√m]
  double lateral_per_sqrt_m = 0.001;  ///< 1σ of 'does not skid sideways' [m/√m]
  double skid_per_sqrt_m = 0.02;      ///< the same for the chassis of `skid` wheels [m/√m]
  double turn_per_sqrt_m = 0.02;      ///< 1σ of the turn of a velocity stream, from travel [rad/√m]
  double turn_per_sqrt_rad = 0.02;    ///< and from turning [rad/√rad]
};

/// A robot's rolling hardware as numbers: trivially copyable, no heap. Names live in Robot.
/// A chassis without wheels takes its motion from a recording's velocity stream (forward, turn).
struct Chassis {
  std::array<Wheel, kMaxWheels> wheel_storage{};
  int wheel_count = 0;
  std::optional<Gyro> gyro;
  ChassisNoise noise;
  double icr_x_m = 0.0;  ///< `skid` wheels: x of the point that does not move sideways in a turn
  double wheels_time_offset_s = 0.0;

  [[nodiscard]] std::span<Wheel> wheels() {
    return {wheel_storage.data(), static_cast<std::size_t>(wheel_count)};
  }
  [[nodiscard]] std::span<const Wheel> wheels() const {
    return {wheel_storage.data(), static_cast<std::size_t>(wheel_count)};
  }
  /// Throws std::length_error beyond kMaxWheels.
  void add(const Wheel& wheel);
};

/// Ground that a count stands for [m]; 0 for a wheel without ticks.
[[nodiscard]] double metres_per_tick(const Wheel& wheel);

/// Wheels that must scrub in turns.
[[nodiscard]] bool has_skid_wheels(const Chassis& chassis);

/// 1σ of a wheel's travel [m/√m]: its own, or that of all wheels.
[[nodiscard]] double wheel_noise(const Chassis& chassis, std::size_t wheel);
/// Root mean square of that over the wheels; without wheels, the noise of the forward travel.
[[nodiscard]] double typical_wheel_noise(const Chassis& chassis);
/// Makes that the typical noise; wheels keep their proportions.
void set_typical_wheel_noise(double per_sqrt_m, Chassis& chassis);

/// What the sensors on board read over one interval: the z of z = H ξ before units.
struct Increment {
  double time_s = 0.0;      ///< end of the interval
  double duration_s = 0.0;  ///< [s]
  /// Per wheel: revolutions, forwards positive. Without wheels: [0] forward travel [m], [1] turn [rad].
  std::array<double, kMaxWheels> turned{};
  double gyro_rad = 0.0;           ///< integral of the gyro's raw reading
  bool has_gyro = false;           ///< false also where it was saturated
  double gyro_change_rad_s = 0.0;  ///< raw rate at the end less that at the start: −∂gyro_rad/∂(time offset)
  /// Added to the variance of a wheel's travel [m²] (without wheels: of forward and of turn [rad²]): where it
  /// slips, its reading counts for little.
  std::array<double, kMaxWheels> slip_variance{};
  /// rms of the accelerometer about its mean over the interval; NaN: not measured.
  double shaking_m_s2 = std::numeric_limits<double>::quiet_NaN();
};

/// Whether a wheel turned (without wheels: whether the robot moved).
[[nodiscard]] bool any_turns(const Increment& increment);

// Common robots. Widths and lengths are between ground contacts [m]; wheel order left to right, front to
// rear.
struct WheelSize {
  double diameter_m = 0.1;
  double ticks_per_revolution = 1000.0;
  int tick_bits = 0;
};
[[nodiscard]] Chassis differential_drive(const WheelSize& size, double track_m);
/// `effective_track_m` is larger than the geometric one because the wheels scrub.
[[nodiscard]] Chassis skid_steer(const WheelSize& size, double effective_track_m, double wheelbase_m);
/// Three wheels at `radius_m`, at azimuths 60°, 180° and −60°, rolling counter-clockwise around the centre.
[[nodiscard]] Chassis omni3(const WheelSize& size, double radius_m);
/// The usual X layout. Order: front left, front right, rear left, rear right.
[[nodiscard]] Chassis mecanum(const WheelSize& size, double track_m, double wheelbase_m);
struct Pod {
  double x_m = 0.0;
  double y_m = 0.0;
  double direction_rad = 0.0;
};
/// Two or three passive wheels, with a gyro.
[[nodiscard]] Chassis dead_wheels(const WheelSize& size, std::span<const Pod> pods, const Gyro& gyro);

}  // namespace trundle::chassis
