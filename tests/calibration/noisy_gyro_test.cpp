// What a gyro's heading walks is no noise of the wheels.
#include <cmath>
#include <cstdio>
#include <utility>

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
double learned_over_true(double gyro_noise, int trials) {
  const Machine machine = differential_machine();
  double squares = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const Driven runs =
        driven(machine, {.duration_s = 120.0, .gyro_noise = gyro_noise}, static_cast<std::uint64_t>(trial));
    const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
    squares += std::pow(result.calibrated.chassis.noise.wheel_per_sqrt_m / kWheelNoise, 2) / trials;
  }
  return std::sqrt(squares);
}

/// Not more of it than a smoother leaves (docs/theory/calibration-noise.md, eq. 8a), with some 20 % for
/// chance; of odometry that is not turned by what its headings walk it is 1.4, 2.2 and 7.2.
TEST(NoisyGyro, ItsWalkIsNoNoiseOfTheWheels) {
  const int trials = test::trials(10, 1);
  for (const auto& [gyro_noise, most] :
       {std::pair(kGyroNoise / 10.0, 1.65), std::pair(kGyroNoise, 1.9), std::pair(3.0 * kGyroNoise, 3.0)}) {
    if (trials < 10 && gyro_noise != kGyroNoise) continue;  // the same arithmetic once more
    const double ratio = learned_over_true(gyro_noise, trials);
    std::printf("gyro %.1e rad/s/√Hz: learned wheel noise %.2f times the true one\n", gyro_noise, ratio);
    EXPECT_GT(ratio, 0.8);
    EXPECT_LT(ratio, most);
  }
}

/// Ten times as noisy as the robot file says: its rests show it, and errors are what the error bars say. With
/// the file's noise the gyro's scale was off by 2.5 sigmas, root mean square.
TEST(NoisyGyro, ItsNoiseIsThatOfItsRests) {
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
