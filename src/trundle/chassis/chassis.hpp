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

/// Whether it may be pushed along them without turning. Where a wheel without rollers rolls is what the
/// body's x axis means; that of one with them is a parameter of its own.
[[nodiscard]] constexpr bool has_rollers(WheelKind kind) {
  return kind == WheelKind::omni || kind == WheelKind::mecanum;
}

/// How a steered wheel stands: at direction + scale · (reading − zero), counter-clockwise.
struct SteeringSensor {
  double zero_rad = 0.0;                    ///< what it reads where the wheel stands at its direction
  double scale = 1.0;                       ///< negative: reads clockwise
  double sigma_rad = 0.008726646259971648;  ///< 1σ of a reading, backlash included: half a degree
  double ticks_per_revolution = 0.0;        ///< of readings in counts; 0: gives none
  double time_offset_s = 0.0;               ///< added to its stamps, which are those of the wheels
  double reading_rad = 0.0;                 ///< of the interval that a chassis stands for; see at_steering()
};

/// One wheel or passive pod: where it touches the ground and what a revolution of it means. Frame: body.
struct Wheel {
  double x_m = 0.0;
  double y_m = 0.0;
  double direction_rad = 0.0;  ///< rolling direction; of a steered wheel where its steering is at zero
  WheelKind kind = WheelKind::fixed;
  double roller_rad = 0.0;  ///< mecanum: from the axle to the free direction of the roller on the ground
  double diameter_m = 0.0;
  double ticks_per_revolution = 0.0;  ///< negative: counts backwards; 0: gives no ticks
  int tick_bits = 0;                  ///< the counter wraps at 2^bits; 0: never
  double recorded_diameter_m = 0.0;   ///< with which recorded travel in metres was computed; 0: unknown
  /// 1σ of its travel [m/√m]; NaN: that of ChassisNoise.
  double noise_per_sqrt_m = std::numeric_limits<double>::quiet_NaN();
  std::optional<SteeringSensor> steering = {};  ///< of a steered wheel
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

/// What a velocity that somebody else computed errs by: truth = forward_scale · v and
/// yaw_scale · ω + yaw_per_forward_rad_m · v + yaw_bias_rad_s of the readings v and ω.
/// docs/theory/velocity.md, eq. 1.
struct VelocityCorrection {
  double forward_scale = 1.0;          ///< negative: forwards reads backwards
  double yaw_scale = 1.0;              ///< negative: counter-clockwise reads clockwise
  double yaw_per_forward_rad_m = 0.0;  ///< turn per metre that is read
  double yaw_bias_rad_s = 0.0;         ///< added at rest too
  /// By which the motion follows what is read, as a command, to first order: taken out when recordings are
  /// aligned. docs/theory/velocity.md, eq. 2.
  double lag_s = 0.0;

  bool operator==(const VelocityCorrection&) const = default;
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
/// Passive wheels have no encoder: they do not skid sideways, and that is all. They stand behind the others.
struct Chassis {
  std::array<Wheel, kMaxWheels> wheel_storage{};
  int wheel_count = 0;    ///< with an encoder
  int passive_count = 0;  ///< without
  std::optional<Gyro> gyro;
  VelocityCorrection velocity;  ///< without wheels
  ChassisNoise noise;
  double icr_x_m = 0.0;  ///< `skid` wheels: the point that does not move sideways in a turn is at −icr_x_m
  /// `skid` wheels: by what share a robot that turns on the spot turns less than its track says, which is
  /// that of wide curves. docs/theory/scrub.md.
  double scrub = 0.0;
  /// By what share a wheel rolls further per square of its speed: tyres that grow.
  /// docs/theory/tyre-growth.md.
  double tyre_growth_s2_m2 = 0.0;
  double wheels_time_offset_s = 0.0;

  [[nodiscard]] std::span<Wheel> wheels() {
    return {wheel_storage.data(), static_cast<std::size_t>(wheel_count)};
  }
  /// Those with an encoder.
  [[nodiscard]] std::span<const Wheel> wheels() const {
    return {wheel_storage.data(), static_cast<std::size_t>(wheel_count)};
  }
  [[nodiscard]] std::span<Wheel> all_wheels() {
    return {wheel_storage.data(), static_cast<std::size_t>(wheel_count + passive_count)};
  }
  /// Passive ones too, behind the others.
  [[nodiscard]] std::span<const Wheel> all_wheels() const {
    return {wheel_storage.data(), static_cast<std::size_t>(wheel_count + passive_count)};
  }
  /// A wheel with an encoder: before the passive ones. Both throw std::length_error beyond kMaxWheels.
  void add(const Wheel& wheel);
  void add_passive(const Wheel& wheel);
};

/// Ground that a count stands for [m]; 0 for a wheel without ticks.
[[nodiscard]] double metres_per_tick(const Wheel& wheel);

/// Of a way and so many counts after it; of a wheel without ticks, of the way alone.
[[nodiscard]] double revolutions_of(const Wheel& wheel, double way_m, double ticks);

/// Where it rolls: its direction, turned by what its steering reads.
[[nodiscard]] double rolling_direction(const Wheel& wheel);

/// Whether the direction of some wheel is measured: then H is another one in each interval.
[[nodiscard]] bool is_steered(const Chassis& chassis);

/// Wheels that must scrub in turns.
[[nodiscard]] bool has_skid_wheels(const Chassis& chassis);

/// Of both scales, in size.
inline constexpr double kLeastVelocityScale = 1e-6;
inline constexpr double kGreatestVelocityScale = 100.0;

/// Forward travel and turn over an interval.
struct ForwardAndTurn {
  double forward_m = 0.0;
  double turn_rad = 0.0;
};
/// What the integrals of a velocity stream mean, and which ones mean that. docs/theory/velocity.md, eq. 1.
[[nodiscard]] ForwardAndTurn corrected(const VelocityCorrection& velocity, const ForwardAndTurn& read,
                                       double duration_s);
[[nodiscard]] ForwardAndTurn read_as(const VelocityCorrection& velocity, const ForwardAndTurn& truth,
                                     double duration_s);

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
  /// Per wheel: revolutions, forwards positive. Without wheels, as the velocity stream reads them:
  /// [0] forward travel [m], [1] turn [rad].
  std::array<double, kMaxWheels> turned{};
  /// Of a robot of skid wheels, half of how much further those on the right turned than those on the left,
  /// times how sharp that turn is: what its scrub grows with. ScrubGauge fills it in.
  double scrub_turned = 0.0;
  /// Per wheel: its revolutions times the square of its speed [1/s²]: what its growth lengthens. SpeedGauge
  /// fills it in, where depends_on_speed().
  std::array<double, kMaxWheels> speed_turned{};
  /// Of each steered wheel, as Chassis::all_wheels(): what its steering reads in the middle [rad].
  std::array<double, kMaxWheels> steering_rad{};
  double gyro_rad = 0.0;           ///< integral of the gyro's raw reading
  bool has_gyro = false;           ///< false also where it was saturated
  double gyro_change_rad_s = 0.0;  ///< raw rate at the end less that at the start: −∂gyro_rad/∂(time offset)
  /// Added to the variance of a wheel's travel [m²] (without wheels: of forward and of turn [rad²]): where it
  /// slips, its reading counts for little.
  std::array<double, kMaxWheels> slip_variance{};
  /// rms of the accelerometer about its mean over the interval; NaN: not measured.
  double shaking_m_s2 = std::numeric_limits<double>::quiet_NaN();
};

/// The chassis as its steered wheels stood in that interval.
[[nodiscard]] Chassis at_steering(const Chassis& chassis, const Increment& increment);

/// Adds what was read over one more interval: its duration, and what is proportional to how far the robot
/// went.
inline void add_readings(Increment& sum, const Increment& increment) {
  sum.duration_s += increment.duration_s;
  sum.gyro_rad += increment.gyro_rad;
  sum.scrub_turned += increment.scrub_turned;
  for (std::size_t i = 0; i < sum.turned.size(); ++i) {
    sum.turned[i] += increment.turned[i];
    sum.speed_turned[i] += increment.speed_turned[i];
  }
}

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
/// One steered and driven wheel, `wheelbase_m` ahead of a passive axle whose middle is the origin.
[[nodiscard]] Chassis tricycle(const WheelSize& size, double wheelbase_m,
                               const SteeringSensor& steering = {});
/// Two wheels on the rear axle, whose middle is the origin. Of the front wheels the steering is measured: of
/// one that stands for both (`front_track_m` 0), or of each.
[[nodiscard]] Chassis ackermann(const WheelSize& size, double track_m, double wheelbase_m,
                                double front_track_m = 0.0, const SteeringSensor& steering = {});
/// Four steered and driven wheels. Order: front left, front right, rear left, rear right.
[[nodiscard]] Chassis swerve(const WheelSize& size, double track_m, double wheelbase_m,
                             const SteeringSensor& steering = {});
struct Pod {
  double x_m = 0.0;
  double y_m = 0.0;
  double direction_rad = 0.0;
};
/// Two or three passive wheels, with a gyro.
[[nodiscard]] Chassis dead_wheels(const WheelSize& size, std::span<const Pod> pods, const Gyro& gyro);

}  // namespace trundle::chassis
