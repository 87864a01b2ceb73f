// How noisy wheels are, by how differences of headings grow that a fit has bent.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"

#include "calibration/gyro_bias_oracle.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test::drifting_gyro;

Machine without_gyro(Machine machine) {
  for (Robot* robot : {&machine.nominal, &machine.truth}) robot->chassis.gyro.reset();
  return machine;
}

/// Of short drives whose diameters and track were fitted to them. What is stated of them goes with the square
/// of the noise: by what is left of the fit alone that was 1.4 times too small.
TEST(GrowthOfHeadings, AllowsForWhatTheFitHasTaken) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Machine machine = without_gyro(differential_machine());
  constexpr int kDraws = 150;
  double sum = 0.0, squares = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Driven drives = driven(machine, {.rate_hz = 20.0, .duration_s = 30.0, .rests = false, .runs = 1},
                           static_cast<std::uint64_t>(draw));
    for (Recording& recording : drives.recordings) recording.gyro = {};
    const CalibrationResult result = calibrate(drives.recordings, {}, machine.nominal);
    const double ratio = std::pow(kWheelNoise / result.calibrated.chassis.noise.wheel_per_sqrt_m, 2);
    sum += ratio;
    squares += ratio * ratio;
  }
  const double mean = sum / kDraws, sigma = std::sqrt((squares / kDraws - mean * mean) / kDraws);
  EXPECT_NEAR(mean, 1.0, 3.0 * sigma);
  EXPECT_LT(sigma, 0.09);
}

}  // namespace
}  // namespace trundle::calibration
