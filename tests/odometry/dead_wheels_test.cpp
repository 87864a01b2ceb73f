// Two dead wheels and a cheap gyro on long tours: how far off is the end?
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "trundle/odometry/integrate.hpp"
#include "trundle/simulation/scenario.hpp"

#include "scale.hpp"

namespace trundle::odometry {
namespace {

constexpr double kGyroRate_hz = 100.0;

Robot dead_wheel_robot() {
  Robot robot;
  robot.name = "dead wheels";
  const std::array<Pod, 2> pods{{{0.0, 0.12, 0.0}, {-0.10, 0.0, 0.5 * kPi}}};
  const Gyro gyro{.noise_rad_s_sqrt_hz = 0.003 / std::sqrt(kGyroRate_hz), .bias_walk_rad_s_sqrt_s = 1e-5};
  robot.chassis = dead_wheels({0.05, 2048.0, 0}, pods, gyro);
  robot.chassis.noise.wheel_per_sqrt_m = 0.001;  // they carry no load
  robot.wheel_names = {"ahead", "across"};
  return robot;
}

/// 60 s at rest, then five legs of 20 m inside 5 × 5 m with 2 s of rest after each.
Path tour(std::uint64_t seed) {
  const Pace pace{.forward_m_s = 0.5};
  Random random(seed, 11);
  Path path = pause(60.0);
  for (int leg = 0; leg < 5; ++leg) {
    const Path more =
        random_tour({.length_m = 20.0, .box_x_m = 5.0, .box_y_m = 5.0, .pause_share = 0.0, .sideways = true},
                    end_of(path), random, pace);
    path = joined({path, more, pause(2.0)});
  }
  return path;
}

struct End {
  double percent = 0.0;  ///< of the path
  double sigma = 0.0;    ///< by the covariance, in percent of the path
};

End end_of_tour(std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = scenario.truth = dead_wheel_robot();
  scenario.truth.chassis.gyro->bias_rad_s = 0.02;  // to be learned
  scenario.path = tour(seed);
  scenario.steering = Steering::truth;
  scenario.encoders.rate_hz = 50.0;
  scenario.gyro.rate_hz = kGyroRate_hz;
  scenario.seed = seed;
  const Simulation simulation = simulate(scenario);
  const IntegratedOdometry odometry = integrate(simulation.recording, scenario.nominal);
  const Pose2& end = odometry.trajectory.poses.back().pose;
  const Pose2& truth = simulation.truth.body.poses.back().pose;
  const double path_m = length_of(scenario.path);
  return {100.0 * std::hypot(end.x - truth.x, end.y - truth.y) / path_m,
          100.0 * std::sqrt(odometry.trajectory.covariances.back().topLeftCorner<2, 2>().trace()) / path_m};
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

TEST(DeadWheels, end_within_a_thousandth_of_the_path_and_as_near_as_their_covariance_says) {
  std::vector<double> percent, sigma, ratio2;
  const int trials = test::trials(100, 15);
  for (int i = 0; i < trials; ++i) {
    const End end = end_of_tour(1 + static_cast<std::uint64_t>(i));
    percent.push_back(end.percent);
    sigma.push_back(end.sigma);
    ratio2.push_back(end.percent * end.percent / (end.sigma * end.sigma));
  }
  double mean_square = 0.0;
  for (const double r : ratio2) mean_square += r / trials;
  std::printf(
      "end error median %.4f %%, worst %.4f %% of the path; theoretical 1 sigma %.4f %%; mean square ratio "
      "%.2f\n",
      median(percent), *std::ranges::max_element(percent), median(sigma), mean_square);
  EXPECT_LE(median(percent), 0.1);
  // Mean of χ²-like ratios: variance at most 2 (one direction dominates); four sigma.
  EXPECT_NEAR(mean_square, 1.0, 4.0 * std::sqrt(2.0 / trials));
}

}  // namespace
}  // namespace trundle::odometry
