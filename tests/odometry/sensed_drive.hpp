#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/random.hpp"

#include "chassis/robots.hpp"

namespace trundle::test {
using namespace odometry;

/// 100 Hz with 0.003 rad/s of white noise per sample, a bias that walks by 1e-5 rad/s/√s.
inline constexpr Gyro kGyro{.noise_rad_s_sqrt_hz = 3e-4, .bias_walk_rad_s_sqrt_s = 1e-5};

inline Robot robot_with_gyro(const Gyro& gyro = kGyro) {
  Robot robot = robot_of(differential_drive({.diameter_m = 0.15, .ticks_per_revolution = 1024}, 0.5));
  robot.chassis.gyro = gyro;
  return robot;
}

/// A piece of a drive at constant speed and turn rate.
struct Piece {
  double duration_s = 1.0;
  double forward_m_s = 0.0;
  double turn_rad_s = 0.0;
};

/// What the sensors of a robot read, interval by interval: whole counts, and a gyro whose integral over an
/// interval has the noise of its samples.
class SensedDrive {
 public:
  SensedDrive(const Robot& truth, double rate_hz, std::uint64_t seed)
      : truth_(truth), step_s_(1.0 / rate_hz), noise_(seed, 1), walk_(seed, 2), slip_(seed, 3) {
    bias_ = truth.chassis.gyro->bias_rad_s;
  }

  /// 0: dead
  double encoder_gain[kMaxWheels] = {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
  double shaking_m_s2 = std::numeric_limits<double>::quiet_NaN();
  double wheel_noise_per_sqrt_m = 0.0;

  Increment next(const Piece& piece) {
    const Chassis& chassis = truth_.chassis;
    const Gyro& gyro = *chassis.gyro;
    const Twist2 motion{piece.forward_m_s * step_s_, 0.0, piece.turn_rad_s * step_s_};
    time_s_ += step_s_;
    Increment increment{.time_s = time_s_, .duration_s = step_s_, .has_gyro = true};
    for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
      const Wheel& wheel = chassis.wheels()[i];
      const double way_m = rolling_row(wheel).dot(motion.vector());
      const double noise_m = slip_.normal(wheel_noise_per_sqrt_m * std::sqrt(std::abs(way_m)));
      revolutions_[i] += encoder_gain[i] * (way_m + noise_m) / (kPi * wheel.diameter_m);
      const double counts = std::round(revolutions_[i] * wheel.ticks_per_revolution);
      increment.turned[i] = (counts - counts_[i]) / wheel.ticks_per_revolution;
      counts_[i] = counts;
    }
    bias_ += walk_.normal(gyro.bias_walk_rad_s_sqrt_s * std::sqrt(step_s_));
    increment.gyro_rad = motion.dtheta / gyro.scale + bias_ * step_s_ +
                         noise_.normal(gyro.noise_rad_s_sqrt_hz * std::sqrt(step_s_));
    increment.shaking_m_s2 = shaking_m_s2;
    return increment;
  }
  std::vector<Increment> over(const std::vector<Piece>& pieces) {
    std::vector<Increment> increments;
    for (const Piece& piece : pieces)
      for (int i = 0; i < static_cast<int>(std::lround(piece.duration_s / step_s_)); ++i)
        increments.push_back(next(piece));
    return increments;
  }
  double bias_rad_s() const { return bias_; }

 private:
  Robot truth_;
  double step_s_;
  double time_s_ = 0.0;
  double bias_ = 0.0;
  Random noise_;
  Random walk_;
  Random slip_;
  std::array<double, kMaxWheels> revolutions_{};
  std::array<double, kMaxWheels> counts_{};
};

inline Robot with_bias(Robot robot, double bias_rad_s) {
  robot.chassis.gyro->bias_rad_s = bias_rad_s;
  return robot;
}

inline Odometer learning(const Robot& robot) {
  return Odometer(robot, {.learn_gyro_bias = true});
}

inline Odometer learning_by_rests_alone(const Robot& robot) {
  return Odometer(robot, {.learn_gyro_bias = true, .compare_turns = false});
}

}  // namespace trundle::test
