// What a gyro and a steered wheel say about each other, of drives by a simulation that knows the library by
// its documentation alone: an encoder that counts, a column that is read, each with its noise, 500 steps a
// second of a bicycle model.
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "trundle/calibration/likelihood/chassis_likelihood.hpp"
#include "trundle/calibration/preparation/preparation.hpp"

namespace trundle::calibration {
namespace {

constexpr double kStep_s = 0.002;
constexpr double kWheelbase_m = 0.15, kDiameter_m = 0.065, kCounts = 1600.0;

/// How a robot is built and read.
struct Tricycle {
  const char* name;
  double wheels_hz;
  double gyro_hz;
  double wheel_per_sqrt_m;
  double steering_deg;  ///< 1σ of a reading of its column
  double gyro_rad_s_sqrt_hz;
};

/// Speed and angle of the front wheel: pieces of some seconds, each channel smoothed over 0.3 s.
struct Commands {
  std::vector<double> speed_m_s, steering_rad;
};

Commands commands(double duration_s, std::mt19937_64& random) {
  const auto between = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  Commands pieces;
  const auto go = [&](double seconds, double speed_m_s, double steering_rad) {
    for (double t = 0.0; t < seconds; t += kStep_s) {
      pieces.speed_m_s.push_back(speed_m_s);
      pieces.steering_rad.push_back(steering_rad);
    }
  };
  go(2.0, 0.0, 0.0);
  while (static_cast<double>(pieces.speed_m_s.size()) * kStep_s < duration_s) {
    const double kind = between(0.0, 1.0), speed_m_s = between(0.2, 0.5), steering_rad = between(-0.9, 0.9);
    const double seconds = between(2.0, 5.0);
    if (kind < 0.2)
      go(seconds, speed_m_s, 0.0);
    else if (kind < 0.4)
      go(seconds, -0.6 * speed_m_s, steering_rad);
    else if (kind < 0.5)
      go(2.5, 0.0, 0.0);
    else if (kind < 0.58)
      go(seconds, 0.15, steering_rad > 0.0 ? 1.3 : -1.3);
    else
      go(seconds, speed_m_s, steering_rad);
  }
  const auto smooth = [](const std::vector<double>& raw) {
    constexpr int kHalf = 75;
    const int n = static_cast<int>(raw.size());
    std::vector<double> sums(raw.size() + 1, 0.0), result(raw.size());
    for (std::size_t i = 0; i < raw.size(); ++i) sums[i + 1] = sums[i] + raw[i];
    for (int i = 0; i < n; ++i) {
      const auto first = static_cast<std::size_t>(std::max(i - kHalf, 0));
      const auto end = static_cast<std::size_t>(std::min(i + kHalf, n));
      result[static_cast<std::size_t>(i)] = (sums[end] - sums[first]) / static_cast<double>(end - first);
    }
    return result;
  };
  return {smooth(pieces.speed_m_s), smooth(pieces.steering_rad)};
}

Robot robot_of(const Tricycle& built) {
  Robot robot;
  robot.wheel_names = {"front"};
  robot.passive_names = {"rear"};
  robot.chassis = tricycle({kDiameter_m, kCounts, 0}, kWheelbase_m,
                           {.sigma_rad = built.steering_deg * std::numbers::pi / 180.0});
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = built.gyro_rad_s_sqrt_hz};
  robot.chassis.noise = {.wheel_per_sqrt_m = built.wheel_per_sqrt_m, .lateral_per_sqrt_m = 1e-5};
  return robot;
}

Recording drive(const Tricycle& built, double duration_s, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const Commands command = commands(duration_s, random);
  const double circumference_m = std::numbers::pi * kDiameter_m;
  const double start_count = std::uniform_real_distribution(0.0, 1.0)(random);
  Recording recording;
  recording.wheels.series = {{"front", WheelUnit::ticks, {}}};
  recording.wheels.steering = {{"front", WheelUnit::radians, {}}};
  double heading_rad = 0.0, travel_m = 0.0, rolled_m = 0.0, misread_m = 0.0;
  double gyro_heading_rad = 0.0, read_rolled_m = 0.0;
  double next_wheels_s = 0.0, next_gyro_s = 0.0, last_gyro_s = 0.0;
  for (std::size_t i = 0; i < command.speed_m_s.size(); ++i) {
    const double time_s = static_cast<double>(i) * kStep_s;
    if (time_s >= next_wheels_s - 1e-9) {
      misread_m += built.wheel_per_sqrt_m * std::sqrt(rolled_m - read_rolled_m) * normal(random);
      read_rolled_m = rolled_m;
      const double before_rad = command.steering_rad[i > 0 ? i - 1 : 0];
      recording.wheels.time_s.push_back(time_s);
      recording.wheels.series[0].value.push_back(
          std::floor((travel_m + misread_m) / circumference_m * kCounts + start_count));
      recording.wheels.steering[0].value.push_back(0.5 * (before_rad + command.steering_rad[i]) +
                                                   built.steering_deg * std::numbers::pi / 180.0 *
                                                       normal(random));
      next_wheels_s += 1.0 / built.wheels_hz;
    }
    if (time_s >= next_gyro_s - 1e-9) {
      const double step_s = time_s - last_gyro_s;
      const double rate = step_s > 0.0 ? (heading_rad - gyro_heading_rad) / step_s +
                                             built.gyro_rad_s_sqrt_hz / std::sqrt(step_s) * normal(random)
                                       : 0.0;
      recording.gyro.time_s.push_back(time_s);
      recording.gyro.yaw_rate_rad_s.push_back(rate);
      gyro_heading_rad = heading_rad;
      last_gyro_s = time_s;
      next_gyro_s += 1.0 / built.gyro_hz;
    }
    const double step_m = command.speed_m_s[i] * kStep_s;
    heading_rad += step_m * std::sin(command.steering_rad[i]) / kWheelbase_m;
    travel_m += step_m;
    rolled_m += std::abs(step_m);
  }
  return recording;
}

class SteeredWithGyro : public testing::TestWithParam<Tricycle> {};

// The score of the true parameters has the mean zero and the stated variance: what is estimated from it is
// neither off nor surer than it may be.
TEST_P(SteeredWithGyro, ScoresOfTheTruthAreThoseOfChance) {
  const Robot robot = robot_of(GetParam());
  std::vector<Parameter> parameters;
  for (const Parameter& parameter : parameters_of(robot))
    for (const char* name : {"front.diameter", "front.steering_zero", "front.steering_scale", "front.x"})
      if (name_of(parameter, robot) == name) parameters.push_back(parameter);
  ASSERT_EQ(parameters.size(), 4U);
  constexpr int kDrives = 24;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(4), squares = sum;
  double chi2 = 0.0, count = 0.0;
  std::mt19937_64 random(9);
  for (int i = 0; i < kDrives; ++i) {
    const calibration::Run run = prepare_run(drive(GetParam(), 60.0, random), robot);
    for (const Information& information : chassis_likelihood(run, robot, parameters, {})) {
      const Eigen::VectorXd score =
          information.gradient.cwiseQuotient(information.matrix.diagonal().cwiseSqrt());
      sum += score;
      squares += score.cwiseAbs2();
      chi2 += information.chi2;
      count += information.count;
    }
  }
  for (Eigen::Index j = 0; j < 4; ++j) {
    const std::string name = name_of(parameters[static_cast<std::size_t>(j)], robot);
    EXPECT_LT(std::abs(sum[j]) / std::sqrt(kDrives), 4.0) << name;  // sigmas of the mean
    EXPECT_LT(squares[j] / kDrives, 1.0 + 4.0 * std::sqrt(2.0 / kDrives)) << name;
  }
  EXPECT_NEAR(chi2 / count, 1.0, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Robots, SteeredWithGyro,
                         testing::Values(Tricycle{"fine", 50.0, 100.0, 0.005, 0.1, 3e-4},
                                         Tricycle{"coarse_steering", 50.0, 100.0, 0.005, 0.5, 3e-4},
                                         Tricycle{"slow", 20.0, 50.0, 0.005, 0.5, 3e-4},
                                         Tricycle{"fast", 100.0, 100.0, 0.002, 0.3, 1e-3}),
                         [](const auto& given) { return given.param.name; });

}  // namespace
}  // namespace trundle::calibration
