#include "trundle/calibration/learn_noise.hpp"

#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "calibration/simulated_runs.hpp"

namespace trundle {
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
  const Robot truth = noisy_differential();
  const auto runs = tours(truth, 10);
  Robot guess = truth;
  guess.chassis.noise.wheel_per_sqrt_m = 0.002;
  guess.chassis.noise.lateral_per_sqrt_m = 0.2;
  guess.chassis.gyro->noise_rad_s_sqrt_hz = 0.0005;
  const LearnedNoise learned = learn_noise(runs, guess);
  ASSERT_GT(learned.pieces, 150) << learned.how;
  // A standard deviation from n values is known to 1/√(2n): four of those.
  const double tolerance = 4.0 / std::sqrt(2.0 * learned.pieces);
  EXPECT_NEAR(learned.noise.wheel_per_sqrt_m / 0.02, 1.0, tolerance);
  EXPECT_NEAR(learned.noise.lateral_per_sqrt_m / 0.015, 1.0, tolerance);
  EXPECT_NEAR(*learned.gyro_rad_s_sqrt_hz / 0.02, 1.0, tolerance);
  EXPECT_NEAR(learned.reference_position_m / kReference_m, 1.0, 0.5);
  EXPECT_NEAR(learned.inside_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / learned.pieces));
  EXPECT_EQ(with_learned_noise(guess, learned).chassis.noise.wheel_per_sqrt_m,
            learned.noise.wheel_per_sqrt_m);
}

TEST(LearnNoise, needs_enough_pieces) {
  const Robot truth = noisy_differential();
  auto runs = tours(truth, 10);
  runs.resize(1);
  runs[0].readings.increments.resize(100);
  EXPECT_THROW(learn_noise(runs, truth), CannotAnswer);
}

}  // namespace
}  // namespace trundle
