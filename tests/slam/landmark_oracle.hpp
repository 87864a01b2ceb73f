// Robots that wind about among landmarks, whose wheels and gyro read the true motion and noise.
// Nothing of the library simulates them: docs/robot.md and docs/recording.md say what is read.
#pragma once

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "trundle/chassis/parameter.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::test::among_landmarks {
using namespace trundle::chassis;
using namespace trundle::recording;

struct Wander {
  double rate_hz = 20.0;
  double sighting_rate_hz = 5.0;
  double duration_s = 300.0;
  int landmarks = 15;
  double wheel_noise = 0.01;  ///< [m/√m]
  double gyro_noise = 0.0;    ///< [rad/s/√Hz]; 0: there is no gyro
  bool rests = false;         ///< two seconds of ten
  double range_sigma_m = 0.03, bearing_sigma_rad = 0.5 * M_PI / 180.0;
};

inline constexpr double kHalfField_m = 5.0;  // landmarks are within ± this, the robot within 0.6 of it
inline constexpr double kLeft_m = 0.1012, kRight_m = 0.0993;  // true diameters
inline constexpr double kTrack_m = 0.312;                     // true; all about the nominal 0.1 and 0.3
inline constexpr double kTrueGyroScale = 1.01, kTrueGyroBias = 0.004;

/// What calibration is given: wrong parameters, right noise.
inline Robot nominal_of(const Wander& drive) {
  Robot robot;
  robot.name = "oracle";
  robot.chassis = differential_drive({0.1, 4096.0, 0}, 0.3);
  robot.wheel_names = {"left", "right"};
  robot.chassis.noise.wheel_per_sqrt_m = drive.wheel_noise;
  if (drive.gyro_noise > 0.0) robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = drive.gyro_noise};
  robot.landmark_sensor = LandmarkSensor{.body_from_sensor = {},
                                         .range_sigma_m = drive.range_sigma_m,
                                         .bearing_sigma_rad = drive.bearing_sigma_rad,
                                         .max_range_m = 4.0 * kHalfField_m};
  return robot;
}

inline Robot truth_of(const Wander& drive) {
  Robot robot = nominal_of(drive);
  if (robot.chassis.gyro) {
    robot.chassis.gyro->scale = kTrueGyroScale;
    robot.chassis.gyro->bias_rad_s = kTrueGyroBias;
  }
  set_value({ParameterKind::diameter, 0}, kLeft_m, robot);
  set_value({ParameterKind::diameter, 1}, kRight_m, robot);
  set_value({ParameterKind::track, -1}, kTrack_m, robot);
  return robot;
}

class Wanderer {
 public:
  Wanderer(const Wander& drive, std::uint64_t seed) : drive_(drive), random_(seed) {
    for (int i = 0; i < drive.landmarks; ++i)
      places_.push_back({uniform(-kHalfField_m, kHalfField_m), uniform(-kHalfField_m, kHalfField_m)});
    recording_.name = "wander";
    recording_.session = "one";
    recording_.wheels.series = {{"left", WheelUnit::radians, {}}, {"right", WheelUnit::radians, {}}};
  }

  Recording recorded() {
    const double dt = 1.0 / drive_.rate_hz;
    const auto steps = static_cast<int>(std::lround(drive_.duration_s * drive_.rate_hz));
    const auto per_sighting = static_cast<int>(std::lround(drive_.rate_hz / drive_.sighting_rate_hz));
    const auto per_choice = static_cast<int>(std::lround(drive_.rate_hz));
    read(0.0, dt, 0.0, 0.0);
    for (int i = 1; i <= steps; ++i) {
      if ((i - 1) % per_choice == 0) choose();
      // At a fifth of a second's pace: no robot jumps from speed to speed.
      const double share = 1.0 - std::exp(-dt / 0.2);
      forward_ += share * (wanted_forward_ - forward_);
      turn_ += share * (wanted_turn_ - turn_);
      move(forward_ * dt, turn_ * dt);
      read(i * dt, dt, forward_ * dt, turn_ * dt);
      if (i % per_sighting == 0) see(i * dt);
    }
    return recording_;
  }

 private:
  struct Place {
    double x, y;
  };

  double normal(double sigma) { return sigma * std::normal_distribution<double>()(random_); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  /// Winding about; towards the middle where it is far from it.
  void choose() {
    if (drive_.rests && choices_++ % 10 >= 8) {
      wanted_forward_ = wanted_turn_ = 0.0;
      return;
    }
    wanted_forward_ = uniform(0.2, 0.6);
    wanted_turn_ = uniform(-1.0, 1.0);
    if (std::hypot(x_, y_) < 0.6 * kHalfField_m) return;
    const double aside = std::atan2(-y_, -x_) - heading_;
    wanted_turn_ = 0.8 * std::atan2(std::sin(aside), std::cos(aside));
  }

  /// The exact arc.
  void move(double forward_m, double turn_rad) {
    const double h = 0.5 * turn_rad, sinc = std::abs(h) < 1e-6 ? 1.0 : std::sin(h) / h;
    x_ += sinc * forward_m * std::cos(heading_ + h);
    y_ += sinc * forward_m * std::sin(heading_ + h);
    heading_ += turn_rad;
  }

  void read(double time_s, double dt, double forward_m, double turn_rad) {
    read_wheels(time_s, forward_m, turn_rad);
    if (drive_.gyro_noise == 0.0) return;
    recording_.gyro.time_s.push_back(time_s);
    recording_.gyro.yaw_rate_rad_s.push_back(turn_rad / dt / kTrueGyroScale + kTrueGyroBias +
                                             normal(drive_.gyro_noise / std::sqrt(dt)));
  }

  void read_wheels(double time_s, double forward_m, double turn_rad) {
    recording_.wheels.time_s.push_back(time_s);
    for (const std::size_t i : {0U, 1U}) {
      const double s = forward_m + (i == 0 ? -0.5 : 0.5) * kTrack_m * turn_rad;
      travel_m_[i] += s + normal(drive_.wheel_noise * std::sqrt(std::abs(s)));
      recording_.wheels.series[i].value.push_back(2.0 * travel_m_[i] / (i == 0 ? kLeft_m : kRight_m));
    }
  }

  void see(double time_s) {
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const double dx = places_[i].x - x_, dy = places_[i].y - y_, range = std::hypot(dx, dy);
      if (range < 0.5) continue;
      const double bearing = std::atan2(dy, dx) - heading_ + normal(drive_.bearing_sigma_rad);
      recording_.sightings.push_back({time_s, "mark " + std::to_string(i),
                                      range + normal(drive_.range_sigma_m),
                                      std::atan2(std::sin(bearing), std::cos(bearing))});
    }
  }

  Wander drive_;
  std::mt19937_64 random_;
  std::vector<Place> places_;
  Recording recording_;
  double travel_m_[2] = {0.0, 0.0};
  int choices_ = 0;
  double wanted_forward_ = 0.0, wanted_turn_ = 0.0, forward_ = 0.0, turn_ = 0.0;
  double x_ = 0.0, y_ = 0.0, heading_ = 0.0;
};

}  // namespace trundle::test::among_landmarks
