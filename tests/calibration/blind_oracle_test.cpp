// Calibrations of robots that nothing of the library simulates: exact arcs, wheels whose roll noise is white
// in distance (variance k² per metre of true travel), a gyro with white noise and a bias, whole counts or
// none. Are the estimates free of bias, and do the 95 % intervals hold the truth? With redundant readings (a
// gyro beside wheels, four skid wheels) a weight that comes from a reading's own noise shows here at once.
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <span>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/statistics/distribution.hpp"

#include "held_limits.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

/// A wheel of the oracle: its travel over (dx, dy, dθ) is cos ψ dx + sin ψ dy + lever dθ.
struct OracleWheel {
  double direction_rad = 0.0;
  double lever_m = 0.0;
  double diameter_m = 0.0;
};

struct Oracle {
  Robot nominal;                          ///< what calibration is given; its noise levels are the true ones
  std::function<void(Robot&)> make_true;  ///< sets the true parameters, for the comparison alone
  std::vector<OracleWheel> wheels;        ///< what really rolls
  bool moves_sideways = false;            ///< on purpose
  double sideways_per_sqrt_m = 0.0;       ///< what it really slides, on wheels that should not
  bool counts = false;                    ///< whole counts
  double rate_hz = 20.0;
  double reference_clock_s =
      0.0;  ///< most that the reference's stamps are off by, anew in each run; 0: they are right
  double reference_rate_hz = 4.0;
  int trials = 0;
};

constexpr double kRollNoise = 0.01;  // [m/√m]
constexpr double kTrueBias = 0.004;  // [rad/s]
constexpr double kTrueScale = 1.01;  // true rate = (reading − bias) · scale
constexpr double kReferencePosition_m = 0.002;
constexpr double kReferenceHeading_rad = 0.005;
constexpr double kDuration_s = 60.0;
constexpr int kRuns = 2;

class BlindDrive {
 public:
  BlindDrive(const Oracle& oracle, std::uint64_t seed) : oracle_(oracle), random_(seed) {
    for (const std::string& name : oracle.nominal.wheel_names)
      recording_.wheels.series.push_back({name, oracle.counts ? WheelUnit::ticks : WheelUnit::radians, {}});
    travel_.assign(oracle.wheels.size(), 0.0);
    recording_.session = "one";
    clock_s_ = std::copysign(uniform(0.2, 1.0), uniform(-1.0, 1.0)) * oracle.reference_clock_s;
  }

  Recording over(double duration_s) {
    const double dt = 1.0 / oracle_.rate_hz;
    const int steps = static_cast<int>(std::lround(duration_s * oracle_.rate_hz));
    const int per_reference = static_cast<int>(std::lround(oracle_.rate_hz / oracle_.reference_rate_hz));
    read(0.0, 0.0);
    measure(0.0);
    for (int i = 1; i <= steps; ++i) {
      if ((i - 1) % static_cast<int>(oracle_.rate_hz) == 0) choose_speeds();
      if (oracle_.reference_clock_s > 0.0) approach_speeds();
      step(dt);
      read(i * dt, dt);
      if (i % per_reference == 0) measure(i * dt);
    }
    return recording_;
  }

 private:
  double normal(double sigma) { return sigma * std::normal_distribution<double>()(random_); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  /// For one second.
  void choose_speeds() {
    const double forward = uniform(0.15, 0.45);
    const double sideways = oracle_.moves_sideways ? uniform(-0.3, 0.3) : 0.0;
    const double turn = uniform(-0.8, 0.8);
    wanted_ = {forward, sideways, turn};
    if (oracle_.reference_clock_s == 0.0)
      std::tie(forward_, sideways_, turn_) = std::tie(forward, sideways, turn);
  }

  /// Where clocks are to be told: at a fifth of a second's pace, for no robot jumps from speed to speed.
  void approach_speeds() {
    const double share = 1.0 - std::exp(-1.0 / (0.2 * oracle_.rate_hz));
    forward_ += share * (wanted_[0] - forward_);
    sideways_ += share * (wanted_[1] - sideways_);
    turn_ += share * (wanted_[2] - turn_);
  }

  /// The exact arc, and what rolls and slides on it.
  void step(double dt) {
    turned_ = turn_ * dt;
    const double dx = forward_ * dt;
    double dy = sideways_ * dt, mean_travel = 0.0;
    for (std::size_t i = 0; i < travel_.size(); ++i) mean_travel += std::abs(rolled(i, dx, dy));
    mean_travel /= static_cast<double>(travel_.size());
    dy += normal(oracle_.sideways_per_sqrt_m * std::sqrt(mean_travel));
    for (std::size_t i = 0; i < travel_.size(); ++i) {
      const double s = rolled(i, dx, dy);
      travel_[i] += s + normal(kRollNoise * std::sqrt(std::abs(s)));
    }
    const double h = 0.5 * turned_;
    const double sinc = std::abs(h) < 1e-6 ? 1.0 - h * h / 6.0 : std::sin(h) / h;
    const double c = std::cos(heading_ + h), s = std::sin(heading_ + h);
    x_ += sinc * (c * dx - s * dy);
    y_ += sinc * (s * dx + c * dy);
    heading_ += turned_;
  }

  double rolled(std::size_t i, double dx, double dy) const {
    const OracleWheel& wheel = oracle_.wheels[i];
    return std::cos(wheel.direction_rad) * dx + std::sin(wheel.direction_rad) * dy + wheel.lever_m * turned_;
  }

  void read(double time_s, double dt) {
    recording_.wheels.time_s.push_back(time_s);
    for (std::size_t i = 0; i < travel_.size(); ++i) {
      const double revolutions = travel_[i] / (M_PI * oracle_.wheels[i].diameter_m);
      const double ticks = oracle_.nominal.chassis.wheels()[i].ticks_per_revolution;
      recording_.wheels.series[i].value.push_back(oracle_.counts ? std::round(revolutions * ticks)
                                                                 : 2.0 * M_PI * revolutions);
    }
    if (!oracle_.nominal.chassis.gyro) return;
    const double density = oracle_.nominal.chassis.gyro->noise_rad_s_sqrt_hz;
    recording_.gyro.time_s.push_back(time_s);
    recording_.gyro.yaw_rate_rad_s.push_back(
        dt == 0.0 ? 0.0 : turned_ / dt / kTrueScale + kTrueBias + normal(density / std::sqrt(dt)));
  }

  void measure(double time_s) {
    ReferenceStream& reference = recording_.reference;
    reference.time_s.push_back(time_s - clock_s_);
    reference.x_m.push_back(x_ + normal(kReferencePosition_m));
    reference.y_m.push_back(y_ + normal(kReferencePosition_m));
    reference.heading_rad.push_back(heading_ + normal(kReferenceHeading_rad));
  }

  const Oracle& oracle_;
  std::mt19937_64 random_;
  Recording recording_;
  std::vector<double> travel_;
  double x_ = 0.0, y_ = 0.0, heading_ = 0.0, turned_ = 0.0;
  double clock_s_ = 0.0;
  std::array<double, 3> wanted_{};
  double forward_ = 0.0, sideways_ = 0.0, turn_ = 0.0;
};

std::vector<Run> runs_of(const Oracle& oracle, std::uint64_t seed) {
  std::vector<Run> runs;
  for (int i = 0; i < kRuns; ++i) {
    Recording recording = BlindDrive(oracle, seed * kRuns + static_cast<std::uint64_t>(i)).over(kDuration_s);
    recording.name = "run " + std::to_string(i);
    runs.push_back(prepare_run(recording, oracle.nominal));
  }
  return runs;
}

/// Of the calibrations of one robot, for one parameter: Σ error, Σ error², and how many intervals hold it.
struct Tally {
  double sum = 0.0;
  double squares = 0.0;
  double predicted_variance = 0.0;
  int inside = 0;
};

std::vector<Tally> tally(const Oracle& oracle, std::vector<Parameter>& parameters) {
  Robot truth = oracle.nominal;
  oracle.make_true(truth);
  std::vector<Tally> tallies;
  for (int trial = 0; trial < oracle.trials; ++trial) {
    std::vector<Run> runs = runs_of(oracle, static_cast<std::uint64_t>(trial));
    parameters = default_parameters(oracle.nominal, from_outside(runs));
    tallies.resize(parameters.size());
    const Estimate estimate = estimate_parameters({runs, oracle.nominal, parameters});
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      const double error = value_of(parameters[j], estimate.robot) - value_of(parameters[j], truth);
      tallies[j].sum += error;
      tallies[j].squares += error * error;
      tallies[j].predicted_variance += estimate.covariance(k, k);
      tallies[j].inside += std::abs(error) <= 1.959964 * std::sqrt(estimate.covariance(k, k)) ? 1 : 0;
    }
  }
  return tallies;
}

/// No estimate is biased beyond what chance makes of so many (once in a thousand such tests: the mean of n
/// over the scatter of the same n is Student's t), and 93 to 97 % of the intervals hold the truth, three
/// standard deviations of the binomial aside; of few, as many as the binomial has it.
void expect_unbiased_and_consistent(const Oracle& oracle) {
  std::vector<Parameter> parameters;
  const std::vector<Tally> tallies = tally(oracle, parameters);
  const double n = oracle.trials;
  const double most_errors = student_t_limit(1e-3 / static_cast<double>(parameters.size()), n - 1.0);
  const double chance = 3.0 * std::sqrt(0.95 * 0.05 / n);
  const auto [least, most] =
      n < 100 ? test::held_limits(oracle.trials) : std::pair(0.93 - chance, 0.97 + chance);
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const auto& [sum, squares, predicted, inside] = tallies[j];
    const std::string name = name_of(parameters[j], oracle.nominal);
    const double mean = sum / n;
    const double sigma = std::sqrt((squares / n - mean * mean) * n / (n - 1.0));
    const double standard_errors = mean / (sigma / std::sqrt(n));
    std::printf("%-16s mean error %+.3g = %+.1f standard errors, sigma %.3g (said: %.3g), %.1f %% inside\n",
                name.c_str(), mean, standard_errors, sigma, std::sqrt(predicted / n), 100.0 * inside / n);
    EXPECT_LE(std::abs(standard_errors), most_errors) << name;
    EXPECT_GE(inside / n, least) << name;
    EXPECT_LE(inside / n, most) << name;
  }
}

Robot robot_with(const Chassis& chassis, const std::vector<std::string>& names, bool with_gyro) {
  Robot robot;
  robot.name = "oracle";
  robot.chassis = chassis;
  robot.chassis.noise.wheel_per_sqrt_m = kRollNoise;
  robot.wheel_names = names;
  if (with_gyro) robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4, .bias_walk_rad_s_sqrt_s = 0.0};
  return robot;
}

void set_gyro(Robot& robot) {
  if (!robot.chassis.gyro) return;
  robot.chassis.gyro->bias_rad_s = kTrueBias;
  robot.chassis.gyro->scale = kTrueScale;
}

void set_two_sided(std::span<const double> diameters, double track, Robot& robot) {
  for (std::size_t i = 0; i < diameters.size(); ++i)
    set_value({ParameterKind::diameter, static_cast<int>(i)}, diameters[i], robot);
  set_value({ParameterKind::track, -1}, track, robot);
  set_gyro(robot);
}

Oracle differential_oracle(bool with_gyro) {
  constexpr std::array kDiameter = {0.1008, 0.0994};
  constexpr double kTrack = 0.306;
  Oracle oracle;
  oracle.nominal = robot_with(differential_drive({0.1, 4096.0, 0}, 0.30), {"left", "right"}, with_gyro);
  oracle.wheels = {{0.0, -0.5 * kTrack, kDiameter[0]}, {0.0, 0.5 * kTrack, kDiameter[1]}};
  oracle.sideways_per_sqrt_m = oracle.nominal.chassis.noise.lateral_per_sqrt_m;
  oracle.make_true = [=](Robot& robot) { set_two_sided(kDiameter, kTrack, robot); };
  return oracle;
}

Oracle skid4_with_gyro() {
  constexpr std::array kDiameter = {0.2014, 0.1990, 0.2006, 0.1985};
  constexpr double kTrack = 0.55;
  Oracle oracle;
  oracle.nominal = robot_with(skid_steer({0.2, 4096.0, 0}, 0.5, 0.4), {"fl", "fr", "rl", "rr"}, true);
  for (std::size_t i = 0; i < 4; ++i)
    oracle.wheels.push_back({0.0, (i % 2 == 0 ? -0.5 : 0.5) * kTrack, kDiameter[i]});
  oracle.sideways_per_sqrt_m = oracle.nominal.chassis.noise.skid_per_sqrt_m;
  oracle.make_true = [=](Robot& robot) { set_two_sided(kDiameter, kTrack, robot); };
  return oracle;
}

Oracle omni3_with_gyro() {
  constexpr std::array kDiameter = {0.101, 0.0985, 0.1003};
  constexpr std::array kTurned = {0.01, -0.02, 0.015};
  constexpr std::array kFurther = {0.004, -0.006, 0.003};
  Oracle oracle;
  oracle.nominal = robot_with(omni3({0.1, 4096.0, 0}, 0.2), {"a", "b", "c"}, true);
  oracle.moves_sideways = true;
  for (std::size_t i = 0; i < 3; ++i) {
    const double azimuth = M_PI * (1.0 + 2.0 * static_cast<double>(i)) / 3.0;  // 60°, 180°, 300°
    oracle.wheels.push_back({azimuth + 0.5 * M_PI + kTurned[i], 0.2 + kFurther[i], kDiameter[i]});
  }
  oracle.make_true = [=](Robot& robot) {
    for (int i = 0; i < 3; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Parameter direction{ParameterKind::direction, i}, lever{ParameterKind::lever, i};
      set_value({ParameterKind::diameter, i}, kDiameter[k], robot);
      set_value(direction, value_of(direction, robot) + kTurned[k], robot);
      set_value(lever, 0.2 + kFurther[k], robot);
    }
    set_gyro(robot);
  };
  return oracle;
}

Oracle with(Oracle oracle, int trials, bool counts = false) {
  oracle.trials = test::trials(trials, 3);
  oracle.counts = counts;
  return oracle;
}

/// Least squares with noisy readings in the sensitivities is unbiased where its gradient is the slope of χ²
/// with the covariances of the residuals moving too (Deming): in the mean over drives, to a fiftieth of the
/// sigma of one. Without the errors in variables of eq. 6a it is off by half of one.
TEST(BlindOracle, TheGradientIsTheSlopeOfChiSquared) {
  Oracle oracle = differential_oracle(false);
  oracle.trials = test::trials(100);
  Robot truth = oracle.nominal;
  oracle.make_true(truth);
  std::vector<Parameter> parameters;
  std::vector<double> sum;
  for (int trial = 0; trial < oracle.trials; ++trial) {
    const auto runs = runs_of(oracle, static_cast<std::uint64_t>(trial));
    parameters = default_parameters(oracle.nominal, from_outside(runs));
    sum.resize(parameters.size());
    const auto information_at = [&](const Robot& robot) {
      const ReferenceNoise noise{.position_m = kReferencePosition_m, .heading_rad = kReferenceHeading_rad};
      return stream_likelihood(runs[0], with_noise_of_readings(robot, oracle.nominal.chassis), parameters,
                               {.reference_noise = noise})
          .total();
    };
    const Information information = information_at(truth);
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      const double value = value_of(parameters[j], truth), step = 1e-4 * value;
      Robot more = truth, less = truth;
      set_value(parameters[j], value + step, more);
      set_value(parameters[j], value - step, less);
      const double slope = (information_at(more).chi2 - information_at(less).chi2) / (2.0 * step);
      sum[j] += (information.gradient[k] + 0.5 * slope) / std::sqrt(information.matrix(k, k));
    }
  }
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    std::printf("%-16s gradient off by %+.4f\n", name_of(parameters[j], truth).c_str(),
                sum[j] / oracle.trials);
    EXPECT_NEAR(sum[j] / oracle.trials, 0.0, 0.05) << name_of(parameters[j], truth);
  }
}

TEST(BlindOracle, DifferentialDrive) {
  expect_unbiased_and_consistent(with(differential_oracle(false), 150));
}

TEST(BlindOracle, DifferentialDriveWithGyro) {
  expect_unbiased_and_consistent(with(differential_oracle(true), 150));
}

TEST(BlindOracle, ReferenceWithAClockOfItsOwn) {
  Oracle oracle = with(differential_oracle(true), 100);
  oracle.reference_rate_hz = 10.0;
  oracle.reference_clock_s = 1.0;
  expect_unbiased_and_consistent(oracle);
}

TEST(BlindOracle, DifferentialDriveWithGyroAndWholeCounts) {
  Oracle oracle = with(differential_oracle(true), 100, true);
  for (Wheel& wheel : oracle.nominal.chassis.wheels()) wheel.ticks_per_revolution = 400.0;
  expect_unbiased_and_consistent(oracle);
}

TEST(BlindOracle, Omni3WithGyro) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_unbiased_and_consistent(with(omni3_with_gyro(), 100));
}

TEST(BlindOracle, Skid4WithGyro) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_unbiased_and_consistent(with(skid4_with_gyro(), 100));
}

}  // namespace
}  // namespace trundle::calibration
