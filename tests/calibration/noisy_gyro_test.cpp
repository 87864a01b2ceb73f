// What a gyro's heading walks is no noise of the wheels.
#include <cmath>
#include <cstdio>
#include <utility>

#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"

#include "calibration/gyro_bias_oracle.hpp"
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
  const int trials = test::trials(20, 1);
  for (const auto& [gyro_noise, most] :
       {std::pair(kGyroNoise / 10.0, 1.65), std::pair(kGyroNoise, 1.9), std::pair(3.0 * kGyroNoise, 3.0)}) {
    const double ratio = learned_over_true(gyro_noise, trials);
    std::printf("gyro %.1e rad/s/√Hz: learned wheel noise %.2f times the true one\n", gyro_noise, ratio);
    EXPECT_GT(ratio, 0.8);
    EXPECT_LT(ratio, most);
  }
}

}  // namespace
}  // namespace trundle::calibration
