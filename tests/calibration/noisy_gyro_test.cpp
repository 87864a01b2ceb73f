// What a gyro's heading walks is no noise of the wheels.
#include <cmath>
#include <cstdio>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/gyro_bias_oracle.hpp"
#include "calibration/stated_errors.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test::drifting_gyro;

/// The wheels' noise as it is learned from four runs of two minutes, root mean square over trials, over the
/// true one; the robot file's gyro is the usual one.
double learned_over_true(double gyro_noise, bool headings, int trials) {
  const Machine machine = differential_machine();
  const Conditions conditions{.duration_s = 120.0, .headings = headings, .gyro_noise = gyro_noise};
  double squares = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const Driven runs = driven(machine, conditions, static_cast<std::uint64_t>(trial));
    const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
    squares += std::pow(result.calibrated.chassis.noise.wheel_per_sqrt_m / kWheelNoise, 2) / trials;
  }
  return std::sqrt(squares);
}

/// Some 440 innovations of two positions show it to 5 % at best, in one trial; its mean square is meant.
TEST(NoisyGyro, ItsWalkIsNoNoiseOfTheWheels) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int trials = test::trials(5, 1);
  for (const bool headings : {true, false})
    for (const double gyro_noise : {kGyroNoise / 10.0, kGyroNoise, 3.0 * kGyroNoise}) {
      const double ratio = learned_over_true(gyro_noise, headings, trials);
      std::printf("gyro %.1e rad/s/√Hz%s: learned wheel noise %.2f times the true one\n", gyro_noise,
                  headings ? "" : ", positions alone", ratio);
      EXPECT_GT(ratio, 0.8);
      EXPECT_LT(ratio, 1.3);
    }
}

/// Ten times as noisy as the robot file says: its rests show it, and errors are what the error bars say. With
/// the file's noise the gyro's scale was off by 2.5 sigmas, root mean square.
TEST(NoisyGyro, ItsNoiseIsThatOfItsRests) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  constexpr double kChance = 1e-3;
  const Machine machine = differential_machine();
  const int trials = test::trials(8, 1);
  double nees = 0.0, degrees = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const Driven runs = driven(machine, {.duration_s = 120.0, .gyro_noise = 10.0 * kGyroNoise},
                               static_cast<std::uint64_t>(trial));
    const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
    EXPECT_NEAR(result.calibrated.chassis.gyro->noise_rad_s_sqrt_hz, 10.0 * kGyroNoise,
                0.25 * 10.0 * kGyroNoise);
    EXPECT_THAT(result.notes, testing::Contains(testing::StartsWith("gyro.noise_rad_s_sqrt_hz 0.00")));
    const test::StatedErrors stated = test::stated_errors(result, machine.truth);
    nees += stated.nees();
    degrees += stated.expected_nees();
  }
  std::printf("squared errors over their sigmas: %.2f of each parameter\n", nees / degrees);
  EXPECT_LT(nees, chi_squared_limit(kChance, degrees));
}

/// What the file says stays where the rests do not contradict it, and where there are none.
TEST(NoisyGyro, WhatTheFileSaysStays) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Machine machine = differential_machine();
  for (const Conditions& conditions : {Conditions{}, Conditions{.gyro_noise = 0.3 * kGyroNoise},
                                       Conditions{.rests = false, .gyro_noise = 5.0 * kGyroNoise}}) {
    const CalibrationResult result =
        calibrate(driven(machine, conditions, 3).recordings, {}, machine.nominal);
    EXPECT_EQ(result.calibrated.chassis.gyro->noise_rad_s_sqrt_hz, kGyroNoise);
    EXPECT_THAT(result.notes, Not(testing::Contains(testing::StartsWith("gyro.noise"))));
  }
}

}  // namespace
}  // namespace trundle::calibration
