// Robots with wheels and a gyro whose bias is another one in each run and walks within it. Nothing of the
// library simulates them: docs/robot.md and docs/recording.md say what a wheel, a gyro and a reference read.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "trundle/chassis/parameter.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::test::drifting_gyro {
using namespace trundle::chassis;
using namespace trundle::recording;

inline constexpr double kWheelNoise = 0.002;  // [m/√m]
inline constexpr double kGyroNoise = 3e-4;    // [rad/s/√Hz]
inline constexpr double kBiasWalk = 1e-5;     // [rad/s/√s]
inline constexpr double kMeanBias = 0.003;    // [rad/s]
inline constexpr double kScale = 1.01;        // true rate = (reading − bias) · scale
inline constexpr double kReferencePosition_m = 0.002;
inline constexpr double kReferenceHeading_rad = 0.005;
inline constexpr double kReferenceRate_hz = 5.0;
inline constexpr double kRest_s = 5.0;
inline constexpr double kSightingRate_hz = 2.0;
inline constexpr double kRange_m = 0.03, kBearing_rad = 0.02;  // 1σ of a sighting
inline constexpr double kFarthest_m = 4.0;                     // that is seen
inline constexpr double kLandmarkSpacing_m = 2.5;              // of a square grid
inline constexpr double kDegree = M_PI / 180.0;

/// A wheel's travel over a body motion (dx, dy, dθ) is cos ψ dx + sin ψ dy + lever dθ.
struct Roller {
  double direction_rad, lever_m, diameter_m;
};

struct Machine {
  Robot nominal;  ///< what calibration is given; the noise of its sensors is the true one
  Robot truth;
  std::vector<Roller> rollers;
  bool moves_sideways = false;
};

struct Conditions {
  double rate_hz = 10.0;
  double duration_s = 60.0;
  double bias_spread_rad_s = 0.0;  ///< from run to run
  double bias_walk = kBiasWalk;
  bool headings = true;  ///< of the reference
  double position_sigma_m = kReferencePosition_m;
  bool rests = true;  ///< before and after
  double gyro_noise = kGyroNoise;
  int sessions = 1, runs = 4;  ///< of each session
  double slip_m = 0.0;         ///< of one wheel, in half a second in the middle of each run
  bool landmarks = false;      ///< are seen, from the middle of the body, in place of the reference
};

/// A gyro so good that the path's error is the wheels' alone.
inline Machine with_good_gyro(Machine machine, Conditions& conditions) {
  conditions.gyro_noise = 2e-5;
  conditions.bias_walk = 1e-6;
  for (Robot* robot : {&machine.nominal, &machine.truth}) {
    robot->chassis.gyro->noise_rad_s_sqrt_hz = conditions.gyro_noise;
    robot->chassis.gyro->bias_walk_rad_s_sqrt_s = conditions.bias_walk;
  }
  return machine;
}

inline Robot with_noise_and_gyro(Chassis chassis, std::vector<std::string> names) {
  Robot robot;
  robot.name = "machine";
  robot.chassis = chassis;
  robot.chassis.noise.wheel_per_sqrt_m = kWheelNoise;
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = kGyroNoise, .bias_walk_rad_s_sqrt_s = kBiasWalk};
  robot.wheel_names = std::move(names);
  return robot;
}

inline void set_true_gyro(Robot& robot) {
  robot.chassis.gyro->bias_rad_s = kMeanBias;
  robot.chassis.gyro->scale = kScale;
}

inline Machine differential_machine() {
  Machine machine;
  machine.nominal = with_noise_and_gyro(differential_drive({0.1, 4096.0, 0}, 0.30), {"left", "right"});
  machine.truth = machine.nominal;
  machine.rollers = {{0.0, -0.153, 0.1008}, {0.0, 0.153, 0.0994}};
  for (int i = 0; i < 2; ++i)
    set_value({ParameterKind::diameter, i}, machine.rollers[static_cast<std::size_t>(i)].diameter_m,
              machine.truth);
  set_value({ParameterKind::track, -1}, 0.306, machine.truth);
  set_true_gyro(machine.truth);
  return machine;
}

inline Machine with_bias_walk(double walk, Machine machine) {
  for (Robot* robot : {&machine.nominal, &machine.truth}) robot->chassis.gyro->bias_walk_rad_s_sqrt_s = walk;
  return machine;
}

/// It sees landmarks too.
inline Machine with_landmark_sensor(Machine machine) {
  for (Robot* robot : {&machine.nominal, &machine.truth})
    robot->landmark_sensor = LandmarkSensor{.body_from_sensor = {},
                                            .range_sigma_m = kRange_m,
                                            .bearing_sigma_rad = kBearing_rad,
                                            .max_range_m = kFarthest_m + 1.0};
  return machine;
}

inline Machine omni_machine() {
  constexpr std::array kDiameter = {0.101, 0.0985, 0.1003};
  constexpr std::array kTurned = {0.01, -0.02, 0.015};
  constexpr std::array kLever = {0.204, 0.194, 0.203};
  Machine machine;
  machine.moves_sideways = true;
  machine.nominal = with_noise_and_gyro(omni3({0.1, 4096.0, 0}, 0.2), {"a", "b", "c"});
  machine.truth = machine.nominal;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Parameter direction{ParameterKind::direction, i};
    const double azimuth = M_PI * (1.0 + 2.0 * i) / 3.0;
    machine.rollers.push_back({azimuth + 0.5 * M_PI + kTurned[k], kLever[k], kDiameter[k]});
    set_value({ParameterKind::diameter, i}, kDiameter[k], machine.truth);
    set_value(direction, value_of(direction, machine.truth) + kTurned[k], machine.truth);
    set_value({ParameterKind::lever, i}, kLever[k], machine.truth);
  }
  set_true_gyro(machine.truth);
  return machine;
}

/// Two passive wheels, one ahead and one across, whose turns the gyro alone tells: nothing is redundant.
inline Machine pods_machine() {
  constexpr std::array kPods = {Pod{0.0, 0.1, 0.0}, Pod{-0.1, 0.0, 90.0 * kDegree}};
  Machine machine;
  machine.moves_sideways = true;
  machine.nominal = with_noise_and_gyro(dead_wheels({0.05, 8192.0, 0}, kPods, {}), {"ahead", "across"});
  machine.truth = machine.nominal;
  machine.rollers = {{0.01, -0.102, 0.0502}, {90.0 * kDegree - 0.015, -0.099, 0.0496}};
  for (int i = 0; i < 2; ++i) {
    const Roller& roller = machine.rollers[static_cast<std::size_t>(i)];
    set_value({ParameterKind::diameter, i}, roller.diameter_m, machine.truth);
    set_value({ParameterKind::direction, i}, roller.direction_rad, machine.truth);
    set_value({ParameterKind::lever, i}, roller.lever_m, machine.truth);
  }
  set_true_gyro(machine.truth);
  return machine;
}

/// One run: rest, drive, rest.
class Drive {
 public:
  Drive(const Machine& machine, const Conditions& conditions, double bias_rad_s, std::uint64_t seed)
      : machine_(machine), conditions_(conditions), random_(seed), bias_(bias_rad_s) {
    for (const std::string& name : machine.nominal.wheel_names)
      recording_.wheels.series.push_back({name, WheelUnit::ticks, {}});
    travel_.assign(machine.rollers.size(), uniform(0.0, 1.0));
  }

  Recording record() {
    const double dt = 1.0 / conditions_.rate_hz;
    const double rest_s = conditions_.rests ? kRest_s : 0.0;
    const double end_s = conditions_.duration_s + 2.0 * rest_s;
    const auto steps = static_cast<int>(std::lround(end_s * conditions_.rate_hz));
    const auto per_reference = static_cast<int>(std::lround(conditions_.rate_hz / kReferenceRate_hz));
    const auto per_sighting = static_cast<int>(std::lround(conditions_.rate_hz / kSightingRate_hz));
    const auto per_second = static_cast<int>(std::lround(conditions_.rate_hz));
    read(0.0, 0.0);
    if (!conditions_.landmarks) measure(0.0);
    for (int i = 1; i <= steps; ++i) {
      const double time_s = i * dt;
      const bool drives = time_s > rest_s && time_s < end_s - rest_s;
      if ((i - 1) % per_second == 0) choose();
      for (std::size_t k = 0; k < 3; ++k) {
        const double share = 1.0 - std::exp(-dt / 0.2);
        now_[k] = drives ? now_[k] + share * (wanted_[k] - now_[k]) : 0.0;
      }
      const double middle_s = 0.5 * end_s;
      const bool slips = time_s > middle_s && time_s <= middle_s + 0.5;
      step(dt, slips ? conditions_.slip_m * dt / 0.5 : 0.0);
      read(time_s, dt);
      if (conditions_.landmarks && i % per_sighting == 0) see(time_s);
      if (!conditions_.landmarks && i % per_reference == 0) measure(time_s);
    }
    mean_bias_ = bias_sum_ / steps;
    return recording_;
  }
  /// Over the run [rad/s].
  double mean_bias() const { return mean_bias_; }

 private:
  double normal(double sigma) { return sigma * std::normal_distribution<double>()(random_); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  void choose() {
    wanted_ = {uniform(0.15, 0.45), machine_.moves_sideways ? uniform(-0.3, 0.3) : 0.0, uniform(-0.8, 0.8)};
  }

  void step(double dt, double slip_m) {
    turned_ = now_[2] * dt;
    const double dx = now_[0] * dt;
    double dy = now_[1] * dt;
    if (!machine_.moves_sideways)
      dy += normal(machine_.nominal.chassis.noise.lateral_per_sqrt_m * std::sqrt(dx));
    for (std::size_t i = 0; i < travel_.size(); ++i) {
      const Roller& r = machine_.rollers[i];
      const double s = std::cos(r.direction_rad) * dx + std::sin(r.direction_rad) * dy + r.lever_m * turned_;
      travel_[i] += s + normal(kWheelNoise * std::sqrt(std::abs(s)));
    }
    travel_[0] += slip_m;
    const double h = 0.5 * turned_, sinc = std::abs(h) < 1e-6 ? 1.0 : std::sin(h) / h;
    const double c = std::cos(heading_ + h), s = std::sin(heading_ + h);
    x_ += sinc * (c * dx - s * dy);
    y_ += sinc * (s * dx + c * dy);
    heading_ += turned_;
    bias_ += normal(conditions_.bias_walk * std::sqrt(dt));
    bias_sum_ += bias_;
  }

  void read(double time_s, double dt) {
    recording_.wheels.time_s.push_back(time_s);
    for (std::size_t i = 0; i < travel_.size(); ++i) {
      const double revolutions = travel_[i] / (M_PI * machine_.rollers[i].diameter_m);
      recording_.wheels.series[i].value.push_back(
          std::floor(revolutions * machine_.nominal.chassis.wheels()[i].ticks_per_revolution));
    }
    recording_.gyro.time_s.push_back(time_s);
    recording_.gyro.yaw_rate_rad_s.push_back(
        dt == 0.0 ? 0.0 : turned_ / dt / kScale + bias_ + normal(conditions_.gyro_noise / std::sqrt(dt)));
  }

  void measure(double time_s) {
    ReferenceStream& reference = recording_.reference;
    reference.time_s.push_back(time_s);
    reference.x_m.push_back(x_ + normal(conditions_.position_sigma_m));
    reference.y_m.push_back(y_ + normal(conditions_.position_sigma_m));
    const double heading = heading_ + normal(kReferenceHeading_rad);
    reference.heading_rad.push_back(conditions_.headings ? heading : std::nan(""));
  }

  void see(double time_s) {
    const auto reach = static_cast<int>(std::ceil(kFarthest_m / kLandmarkSpacing_m));
    const auto column = static_cast<int>(std::lround(x_ / kLandmarkSpacing_m)),
               row = static_cast<int>(std::lround(y_ / kLandmarkSpacing_m));
    for (int i = column - reach; i <= column + reach; ++i)
      for (int j = row - reach; j <= row + reach; ++j) {
        const double dx = kLandmarkSpacing_m * i - x_, dy = kLandmarkSpacing_m * j - y_;
        const double range = std::hypot(dx, dy);
        if (range > kFarthest_m || range < 0.5) continue;
        const double bearing = std::atan2(dy, dx) - heading_ + normal(kBearing_rad);
        recording_.sightings.push_back({time_s, std::to_string(i) + "/" + std::to_string(j),
                                        range + normal(kRange_m),
                                        std::atan2(std::sin(bearing), std::cos(bearing))});
      }
  }

  const Machine& machine_;
  Conditions conditions_;
  std::mt19937_64 random_;
  Recording recording_;
  std::vector<double> travel_;
  std::array<double, 3> wanted_{}, now_{};
  double x_ = 0.0, y_ = 0.0, heading_ = 0.0, turned_ = 0.0;
  double bias_ = 0.0, bias_sum_ = 0.0, mean_bias_ = 0.0;
};

/// Runs, and the mean bias in each.
struct Driven {
  std::vector<Recording> recordings;
  std::vector<double> bias_rad_s;
};

inline Driven driven(const Machine& machine, const Conditions& conditions, std::uint64_t seed) {
  Driven driven;
  std::mt19937_64 random(1000 + seed);
  for (int session = 0; session < conditions.sessions; ++session)
    for (int run = 0; run < conditions.runs; ++run) {
      const double bias =
          kMeanBias + conditions.bias_spread_rad_s * std::normal_distribution<double>()(random);
      Drive drive(machine, conditions, bias, random());
      driven.recordings.push_back(drive.record());
      driven.bias_rad_s.push_back(drive.mean_bias());
      driven.recordings.back().name = "run " + std::to_string(session) + "/" + std::to_string(run);
      driven.recordings.back().session = "session " + std::to_string(session);
    }
  return driven;
}

}  // namespace trundle::test::drifting_gyro
