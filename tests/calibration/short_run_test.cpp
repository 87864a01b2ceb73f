// One run as short as a first try: what is learned of it may be little, but never that there is no noise.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/gyro_bias_oracle.hpp"
#include "calibration/stated_errors.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test::drifting_gyro;

struct ShortCase {
  std::string name;
  double file_noise;  ///< of the wheels, over the true one
  Conditions conditions;
};

std::vector<ShortCase> short_cases() {
  std::vector<ShortCase> cases;
  for (const double file_noise : {1.0, 5.0})
    for (const bool headings : {true, false})
      for (const double rate_hz : {10.0, 50.0})
        cases.push_back({"file's noise " + std::to_string(static_cast<int>(file_noise)) + "x, " +
                             std::to_string(static_cast<int>(rate_hz)) + " Hz, headings " +
                             (headings ? "yes" : "no"),
                         file_noise,
                         {.rate_hz = rate_hz, .duration_s = 20.0, .headings = headings, .runs = 1}});
  return cases;
}

/// Before what growth cannot show was counted (docs/theory/calibration-noise.md, eq. 8b) the squared errors
/// of diameters were up to 30 times those stated, and one run in ten had no answer.
TEST(ShortRun, IsAsSureAsItMayBe) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int trials = test::trials(20, 2);
  for (const ShortCase& c : short_cases()) {
    Machine machine = differential_machine();
    machine.nominal.chassis.noise.wheel_per_sqrt_m = c.file_noise * kWheelNoise;
    double nees = 0.0, expected = 0.0;
    double log_noise = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      const Driven runs = driven(machine, c.conditions, static_cast<std::uint64_t>(trial));
      const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
      const test::StatedErrors stated = test::stated_errors(result, machine.truth);
      nees += stated.nees();
      expected += stated.expected_nees();
      log_noise += std::log(result.calibrated.chassis.noise.wheel_per_sqrt_m / kWheelNoise) / trials;
    }
    std::printf("%-36s NEES %.1f (expected %.0f), learned wheel noise %.2f times the true one\n",
                c.name.c_str(), nees, expected, std::exp(log_noise));
    EXPECT_LT(nees, chi_squared_limit(1e-3, expected)) << c.name;
    EXPECT_GT(log_noise, std::log(0.8)) << c.name;
    EXPECT_LT(log_noise, std::log(3.0)) << c.name;
  }
}

}  // namespace
}  // namespace trundle::calibration
