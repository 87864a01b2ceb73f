#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/QR>

#include "trundle/chassis/chassis.hpp"
#include "trundle/geometry/pose2.hpp"

/// What wheels and gyro read on a known drive, made by the model of docs/theory/chassis.md alone, so that
/// odometry can be held against it. Shares no code with trundle/simulation.
namespace trundle::coverage {
using namespace chassis;

/// xoshiro256++, seeded by splitmix64.
class Random {
 public:
  explicit Random(std::uint64_t seed) {
    for (std::uint64_t& word : state_) word = splitmix(seed);
  }

  static std::uint64_t splitmix(std::uint64_t& x) {
    std::uint64_t z = x += 0x9e3779b97f4a7c15ULL;
    z = (z ^ z >> 30U) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ z >> 27U) * 0x94d049bb133111ebULL;
    return z ^ z >> 31U;
  }

  /// In (0, 1).
  double uniform() { return (static_cast<double>(next() >> 11U) + 0.5) * 0x1p-53; }

  /// Standard normal, by Box and Muller: two for each pair of uniforms.
  double normal() {
    if (spare_) {
      const double value = *spare_;
      spare_.reset();
      return value;
    }
    const double radius = std::sqrt(-2.0 * std::log(uniform()));
    const double angle = 2.0 * kPi * uniform();
    spare_ = radius * std::sin(angle);
    return radius * std::cos(angle);
  }

 private:
  std::uint64_t next() {
    auto& s = state_;
    const std::uint64_t result = std::rotl(s[0] + s[3], 23) + s[0];
    const std::uint64_t shifted = s[1] << 17U;
    s[2] ^= s[0];
    s[3] ^= s[1];
    s[1] ^= s[2];
    s[0] ^= s[3];
    s[2] ^= shifted;
    s[3] = std::rotl(s[3], 45);
    return result;
  }

  std::array<std::uint64_t, 4> state_{};
  std::optional<double> spare_;
};

enum class Motion { straight, turning, stop_and_go, reversing };

/// At one velocity, for so long.
struct Piece {
  Vector3 velocity;  ///< of the body [m/s, rad/s]
  double duration_s = 0.0;
};

inline double length_of(std::span<const Piece> pieces) {
  double sum = 0.0;
  for (const Piece& piece : pieces) sum += piece.duration_s;
  return sum;
}

/// How the body is driven.
struct Drive {
  Motion motion = Motion::straight;
  double rest_s = 0.0;       ///< standing still before it
  double duration_s = 20.0;  ///< of moving, without that rest
  double speed_m_s = 0.3;
  double crab_rad = 0.0;  ///< direction of travel in the body frame; not 0 for chassis that can move sideways
  std::vector<Piece> pieces = {};  ///< instead of all that, where there are any
};

/// 0 to 1 over `ramp`, 1, and back to 0 at the end of `length`; 0 outside.
inline double trapezoid(double t, double length, double ramp) {
  return std::clamp(std::min(t, length - t) / ramp, 0.0, 1.0);
}

/// Share of the speed at a time of the drive, negative backwards.
inline double speed_share(const Drive& drive, double t) {
  const double length = drive.duration_s;
  switch (drive.motion) {
    case Motion::straight:  // a quarter each of accelerating and braking
    case Motion::turning:
      return trapezoid(t, length, length / 4.0);
    case Motion::stop_and_go:  // 2.5 s of moving and 1.5 s at rest
      return trapezoid(std::fmod(t, 4.0), 2.5, 0.5);
    case Motion::reversing:  // a quarter forwards, the rest backwards
      return trapezoid(t, length / 4.0, 0.5) - trapezoid(t - length / 4.0, 0.75 * length, 0.5);
  }
  return 0.0;
}

/// Body velocity [m/s, rad/s] at a time of the drive. Turns are arcs of 1/1.5 m radius, left and right in
/// turn, each of which would last 1.5 rad at full speed.
inline Vector3 velocity_at(const Drive& drive, double t) {
  for (const Piece& piece : drive.pieces)
    if ((t -= piece.duration_s) < 0.0) return piece.velocity;
  const double speed = drive.speed_m_s * speed_share(drive, t);
  double curvature = 0.0;
  if (drive.motion == Motion::turning) curvature = std::fmod(t * drive.speed_m_s, 2.0) < 1.0 ? 1.5 : -1.5;
  return {speed * std::cos(drive.crab_rad), speed * std::sin(drive.crab_rad), speed * curvature};
}

/// h of a wheel's travel s = h·ξ: d + tan γ n (docs/theory/chassis.md, eq. 2 to 4; γ = 0 but for mecanum
/// wheels).
inline Vector3 travel_row(const Wheel& wheel) {
  const double c = std::cos(wheel.direction_rad);
  const double s = std::sin(wheel.direction_rad);
  const Vector3 along(c, s, wheel.x_m * s - wheel.y_m * c);
  const Vector3 across(-s, c, wheel.x_m * c + wheel.y_m * s);
  return wheel.kind == WheelKind::mecanum ? Vector3(along + std::tan(wheel.roller_rad) * across) : along;
}

/// 1σ of the sideways skid [m/√m]; 0 where no row says that the chassis does not skid.
inline double skid_noise(const Chassis& chassis) {
  switch (chassis.wheels().front().kind) {
    case WheelKind::fixed:
      return chassis.noise.lateral_per_sqrt_m;
    case WheelKind::skid:
      return chassis.noise.skid_per_sqrt_m;
    default:
      return 0.0;
  }
}

/// A drive as it truly was, interval by interval, and what was read of it.
///
///   truth     pose ← pose · Exp(ξ), ξ = velocity · dt, and the skid: dy = N(0, k_l² · mean |s|)
///   wheels    φ ← φ + s + N(0, k² |s|), s = h · ξ;  reading: difference of round(φ/q + phase)
///   gyro      dθ/scale + bias · dt + N(0, density² dt);  bias ← bias + N(0, walk² dt)
///
///   steering  zero + angle/scale + N(0, σ²), angle: atan2 of the velocity of its place, halfway in the
///   interval
///
/// All fixed or skid wheels must have the lateral row (0, 1, −x_icr), but for steered ones: with such the
/// skids of all fixed wheels, N(0, k_l² · mean |s|) each, move the body by the least motion that has them.
class SimulatedDrive {
 public:
  /// `gyro_bias_error`: by how much the gyro's bias truly differs from the robot file's [rad/s].
  SimulatedDrive(const Chassis& chassis, const Drive& drive, double rate_hz, std::uint64_t seed,
                 double gyro_bias_error = 0.0)
      : chassis_(chassis), drive_(drive), dt_(1.0 / rate_hz), random_(seed) {
    intervals_ = std::lround((drive.rest_s + drive.duration_s) * rate_hz);
    steer(Vector3::Zero());
    for (const Wheel& wheel : chassis.wheels()) {
      const auto i = counters_++;
      const double ticks = wheel.ticks_per_revolution == 0.0 ? kManyTicks : wheel.ticks_per_revolution;
      tick_m_[i] = kPi * wheel.diameter_m / ticks;
      phase_[i] = random_.uniform();
    }
    if (chassis.gyro) bias_ = chassis.gyro->bias_rad_s + gyro_bias_error;
  }

  bool over() const { return done_ == intervals_; }
  const Pose2& truth() const { return truth_; }
  /// Where it would be if it did not skid.
  const Pose2& planned() const { return planned_; }
  /// Of the last interval [m]: without noise, and as it would be read without rounding.
  const std::array<double, kMaxWheels>& travel() const { return travel_; }
  const std::array<double, kMaxWheels>& noisy_travel() const { return noisy_; }

  /// Drives on by one interval.
  Increment next() {
    const double middle = (static_cast<double>(done_) + 0.5) * dt_ - drive_.rest_s;
    const Vector3 twist = move(middle < 0.0 ? Vector3::Zero().eval() : velocity_at(drive_, middle));
    ++done_;
    Increment reading;
    reading.time_s = static_cast<double>(done_) * dt_;
    reading.duration_s = dt_;
    for (std::size_t i = 0; i < counters_; ++i) {
      reading.turned[i] = count(i) * tick_m_[i] / (kPi * chassis_.wheels()[i].diameter_m);
    }
    if (chassis_.gyro) read_gyro(twist.z(), reading);
    for (std::size_t i = 0; i < chassis_.all_wheels().size(); ++i)
      if (const auto& steering = chassis_.all_wheels()[i].steering)
        reading.steering_rad[i] =
            steering->zero_rad + angle_[i] / steering->scale + steering->sigma_rad * random_.normal();
    return reading;
  }

 private:
  /// The body's twist, skid included.
  Vector3 move(const Vector3& velocity) {
    Vector3 twist = velocity * dt_;
    if (is_steered(chassis_)) steer(velocity);
    double mean = 0.0;
    for (std::size_t i = 0; i < counters_; ++i) mean += std::abs(row_[i].dot(twist));
    mean /= static_cast<double>(counters_);
    const double k = skid_noise(chassis_);
    if (is_steered(chassis_)) {
      twist += skid(k * std::sqrt(mean));
    } else if (k > 0.0) {
      twist.y() = chassis_.icr_x_m * twist.z() + k * std::sqrt(mean) * random_.normal();
    }
    planned_ = planned_ * exp(Twist2::from(velocity * dt_));
    truth_ = truth_ * exp(Twist2::from(twist));
    for (std::size_t i = 0; i < counters_; ++i) {
      travel_[i] = row_[i].dot(twist);
      noisy_[i] =
          travel_[i] + chassis_.noise.wheel_per_sqrt_m * std::sqrt(std::abs(travel_[i])) * random_.normal();
    }
    return twist;
  }

  /// Turns each steered wheel to where its place moves, rolling backwards where that is nearer to ahead.
  void steer(const Vector3& velocity) {
    for (std::size_t i = 0; i < chassis_.all_wheels().size(); ++i) {
      Wheel wheel = chassis_.all_wheels()[i];
      const double vx = velocity.x() - velocity.z() * wheel.y_m;
      const double vy = velocity.y() + velocity.z() * wheel.x_m;
      if (wheel.steering && std::hypot(vx, vy) > 0.0)
        angle_[i] = std::remainder(std::atan2(vy, vx) - wheel.direction_rad, kPi);
      wheel.direction_rad += angle_[i];
      row_[i] = travel_row(wheel);
    }
  }

  Vector3 skid(double sigma) {
    Eigen::MatrixXd N(0, 3);
    std::optional<double> axle_x;  // wheels that are not steered stand on one
    for (std::size_t i = 0; i < chassis_.all_wheels().size(); ++i) {
      const Wheel& wheel = chassis_.all_wheels()[i];
      if (!wheel.steering && axle_x) continue;
      if (!wheel.steering) axle_x = wheel.x_m;
      const double c = std::cos(wheel.direction_rad + angle_[i]);
      const double s = std::sin(wheel.direction_rad + angle_[i]);
      N.conservativeResize(N.rows() + 1, 3);
      N.bottomRows(1) << -s, c, wheel.x_m * c + wheel.y_m * s;
    }
    Eigen::VectorXd skids(N.rows());
    for (double& one : skids) one = sigma * random_.normal();
    Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
    solver.setThreshold(1e-9);
    return solver.compute(N).solve(skids);
  }

  /// How far the counter went on in this interval.
  double count(std::size_t i) {
    const double before = std::round(rolled_m_[i] / tick_m_[i] + phase_[i]);
    rolled_m_[i] += noisy_[i];
    return std::round(rolled_m_[i] / tick_m_[i] + phase_[i]) - before;
  }

  void read_gyro(double turn, Increment& reading) {
    const Gyro& gyro = *chassis_.gyro;
    const double root_dt = std::sqrt(dt_);
    reading.has_gyro = true;
    reading.gyro_rad =
        turn / gyro.scale + bias_ * dt_ + gyro.noise_rad_s_sqrt_hz * root_dt * random_.normal();
    bias_ += gyro.bias_walk_rad_s_sqrt_s * root_dt * random_.normal();
  }

  static constexpr double kManyTicks = 1e9;  ///< of a revolution: of encoders that do not round

  Chassis chassis_;
  Drive drive_;
  double dt_;
  Random random_;
  std::int64_t intervals_ = 0;
  std::int64_t done_ = 0;
  std::size_t counters_ = 0;
  std::array<Vector3, kMaxWheels> row_{};
  std::array<double, kMaxWheels> angle_{};  ///< of steered wheels, from their direction_rad
  std::array<double, kMaxWheels> tick_m_{};
  std::array<double, kMaxWheels> phase_{};
  std::array<double, kMaxWheels> rolled_m_{};
  std::array<double, kMaxWheels> travel_{};
  std::array<double, kMaxWheels> noisy_{};
  double bias_ = 0.0;
  Pose2 truth_;
  Pose2 planned_;
};

}  // namespace trundle::coverage
