#include "trundle/calibration/noise/learn_noise.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/noise/displacements.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/io/error.hpp"

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

constexpr double kReference_m = 0.005;

/// Long tours with a reference.
std::vector<Run> tours(const Robot& truth, std::uint64_t seed) {
  std::vector<Run> runs;
  for (std::uint64_t i = 0; i < 4; ++i) {
    Random random(seed + i, 7);
    Scenario scenario = test::scenario_of(
        truth, truth, random_tour({.length_m = 60.0}, {}, random, {.forward_m_s = 0.5}), seed + i);
    scenario.encoders.rate_hz = 10.0;
    scenario.reference.rate_hz = 10.0;
    scenario.reference.position_sigma_m = kReference_m;
    runs.push_back(prepare_run(simulate(scenario).recording, truth));
  }
  return runs;
}

Robot noisy_differential() {
  Robot robot = test::nominal_differential();
  robot.chassis.noise.wheel_per_sqrt_m = 0.02;
  robot.chassis.noise.lateral_per_sqrt_m = 0.015;
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 0.02, .bias_walk_rad_s_sqrt_s = 0.0};
  return robot;
}

TEST(LearnNoise, finds_the_noise_that_made_the_runs) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Robot truth = noisy_differential();
  const auto runs = tours(truth, 10);
  Robot guess = truth;
  guess.chassis.noise.wheel_per_sqrt_m = 0.002;
  guess.chassis.noise.lateral_per_sqrt_m = 0.2;
  guess.chassis.gyro->noise_rad_s_sqrt_hz = 0.0005;
  const LearnedNoise learned = learn_noise(runs, guess);
  ASSERT_GT(learned.displacements, 150) << learned.how;
  // A standard deviation from n values is known to 1/√(2n): four of those.
  const double tolerance = 4.0 / std::sqrt(2.0 * learned.displacements);
  EXPECT_NEAR(learned.levels.wheel_per_sqrt_m / 0.02, 1.0, tolerance);
  EXPECT_NEAR(learned.levels.sideways_per_sqrt_m / 0.015, 1.0, tolerance);
  EXPECT_NEAR(learned.levels.gyro_rad_s_sqrt_hz / 0.02, 1.0, tolerance);
  EXPECT_NEAR(learned.levels.reference.position_m / kReference_m, 1.0, 0.5);
  EXPECT_NEAR(learned.inside_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / learned.displacements));
  EXPECT_EQ(with_noise(guess, learned.levels).chassis.noise.wheel_per_sqrt_m,
            learned.levels.wheel_per_sqrt_m);
}

/// Noise of the robot's wheels, one after the other.
Robot with_wheel_noise(Robot robot, const std::vector<double>& per_sqrt_m) {
  for (std::size_t i = 0; i < per_sqrt_m.size(); ++i)
    robot.chassis.wheels()[i].noise_per_sqrt_m = per_sqrt_m[i];
  return robot;
}

Robot without_wheel_noise(Robot robot) {
  for (Wheel& wheel : robot.chassis.wheels()) wheel.noise_per_sqrt_m = Wheel{}.noise_per_sqrt_m;
  robot.chassis.noise.wheel_per_sqrt_m = 0.01;
  return robot;
}

void expect_wheels_told_apart(const Robot& truth, std::uint64_t seed) {
  const LearnedNoise learned = learn_noise(tours(truth, seed), without_wheel_noise(truth));
  ASSERT_EQ(learned.wheels.size(), truth.chassis.wheels().size()) << learned.how;
  const Robot robot = with_noise(truth, learned.levels);
  for (std::size_t i = 0; i < learned.wheels.size(); ++i) {
    const double own = truth.chassis.wheels()[i].noise_per_sqrt_m;
    EXPECT_NEAR(learned.wheels[i].per_sqrt_m, own, 4.0 * learned.wheels[i].sigma) << i << ": " << learned.how;
    EXPECT_LT(learned.wheels[i].sigma, 0.35 * own) << i;
    EXPECT_EQ(wheel_noise(robot.chassis, i), learned.wheels[i].per_sqrt_m);
  }
  EXPECT_NEAR(learned.inside_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / learned.displacements)) << learned.how;
  // And on runs that it was not learned from.
  const auto fresh_runs = tours(truth, seed + 500);
  const std::vector<Displacement> fresh = displacements(fresh_runs, robot, 2.0);
  EXPECT_NEAR(share_inside(fresh, robot, learned.levels), 0.95,
              4.0 * std::sqrt(0.95 * 0.05 / static_cast<double>(fresh.size())));
}

TEST(LearnNoise, tells_the_wheels_of_a_differential_drive_apart_by_their_errors) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Robot truth = noisy_differential();
  truth.chassis.gyro.reset();
  expect_wheels_told_apart(with_wheel_noise(truth, {0.01, 0.03}), 20);
}

TEST(LearnNoise, tells_wheels_apart_where_a_gyro_checks_them) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Robot truth = test::nominal_omni3();
  truth.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 0.002, .bias_walk_rad_s_sqrt_s = 0.0};
  for (const std::uint64_t seed : {30U, 130U, 230U})
    expect_wheels_told_apart(with_wheel_noise(truth, {0.008, 0.03, 0.012}), seed);
}

TEST(LearnNoise, wheels_that_are_alike_are_not_told_apart) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Robot truth = noisy_differential();
  const LearnedNoise learned = learn_noise(tours(truth, 40), truth);
  EXPECT_TRUE(learned.wheels.empty()) << learned.how;
  EXPECT_THAT(learned.how, testing::HasSubstr("no wheel shows one of its own"));
}

/// Wheels that check each other, of counts whose rounding is all that they read where it stands.
Robot noisy_skid_steer() {
  Robot robot = test::robot_of(skid_steer({0.2, 2000.0, 0}, 0.5, 0.4), {"fl", "fr", "rl", "rr"});
  robot.chassis.noise.wheel_per_sqrt_m = 0.003;
  robot.chassis.noise.skid_per_sqrt_m = 0.02;
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 0.0003, .bias_walk_rad_s_sqrt_s = 0.0};
  return robot;
}

/// Tours with rests as long as pieces.
std::vector<Run> tours_with_rests(const Robot& truth, std::uint64_t seed) {
  std::vector<Run> runs;
  for (std::uint64_t i = 0; i < 2; ++i) {
    Random random(seed + i, 7);
    Scenario scenario = test::scenario_of(
        truth, truth,
        random_tour({.length_m = 40.0, .pause_share = 0.3}, {}, random, {.forward_m_s = 0.5, .rest_s = 4.0}),
        seed + i);
    scenario.encoders.rate_hz = 10.0;
    scenario.reference.rate_hz = 10.0;
    scenario.reference.position_sigma_m = 0.002;
    scenario.reference.heading_sigma_rad = 0.004;
    runs.push_back(prepare_run(simulate(scenario).recording, truth));
  }
  return runs;
}

NoiseLevels times(NoiseLevels levels, double factor) {
  levels.wheel_per_sqrt_m *= factor;
  levels.gyro_rad_s_sqrt_hz *= factor;
  return levels;
}

TEST(LearnNoise, what_no_motion_explains_makes_no_noise_likelier_for_being_larger) {
  const Robot truth = noisy_skid_steer();
  const auto runs = tours_with_rests(truth, 50);
  const std::vector<Displacement> all = displacements(runs, truth, 2.0);
  const NoiseLevels levels = noise_levels_of(truth);
  const auto deviance = [&](double factor) {
    return parity_deviance(all, truth, times(levels, factor), WheelErrors::partly_alike).deviance;
  };
  // Beyond what shows all are alike, but for what a share found to δ = 1e-3 costs: n δ²/2 of n < 1000
  // residuals, on either side.
  const double beyond = deviance(2.0);
  for (const double factor : {4.0, 16.0, 64.0}) EXPECT_NEAR(deviance(factor), beyond, 0.001) << factor;
  // Half of what shows is less likely by log 1/4 − 1 + 4 for each of three residuals of a piece that moves.
  EXPECT_GT(deviance(0.5), beyond + static_cast<double>(all.size()));
}

TEST(LearnNoise, a_skid_steer_robot_is_not_noisier_for_resting) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Robot truth = noisy_skid_steer();
  Robot guess = truth;
  guess.chassis.noise.wheel_per_sqrt_m = 0.02;
  const int trials = test::trials(8, 2);
  double mean_log = 0.0, variance = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto runs = tours_with_rests(truth, 100 + 10 * static_cast<std::uint64_t>(trial));
    const LearnedNoise learned = learn_noise(runs, guess, {.per_wheel = false});
    const std::vector<Displacement> all = displacements(runs, truth, 2.0);
    const auto moving = static_cast<double>(std::ranges::count_if(
        all, [&](const Displacement& d) { return mean_travel(truth.chassis, d.rolled) > 0.1; }));
    ASSERT_LT(moving, 0.9 * static_cast<double>(all.size()));
    // The front wheel and the rear one of either side differ by their own noise alone: two residuals of each
    // piece, and a standard deviation from n values is known to 1/√(2n).
    mean_log += std::log(learned.levels.wheel_per_sqrt_m / 0.003) / trials;
    variance += 1.0 / (4.0 * moving) / (trials * trials);
    EXPECT_NEAR(learned.inside_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / static_cast<double>(all.size())))
        << learned.how;
  }
  EXPECT_NEAR(mean_log, 0.0, 4.0 * std::sqrt(variance));
}

TEST(LearnNoise, needs_enough_displacements) {
  const Robot truth = noisy_differential();
  auto runs = tours(truth, 10);
  runs.resize(1);
  runs[0].readings.increments.cut(0, 100);
  EXPECT_THROW((void)learn_noise(runs, truth), CannotAnswer);
}

}  // namespace
}  // namespace trundle::calibration
