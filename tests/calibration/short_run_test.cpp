// One run as short as a first try: what is learned of it may be little, but never that there is no noise.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/gyro_bias_oracle.hpp"
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

/// Of the parameters but the gyro's bias, which walks.
struct Nees {
  double value = 0.0;
  double expected = 0.0;
};

Nees nees_of(const CalibrationResult& result, const Robot& truth) {
  std::vector<Eigen::Index> kept;
  std::vector<double> errors;
  Eigen::Index row = 0;
  for (const ParameterEstimate& e : result.parameters) {
    if (!e.observable) continue;
    if (e.parameter.kind != ParameterKind::gyro_bias) {
      kept.push_back(row);
      errors.push_back(e.value - value_of(e.parameter, truth));
    }
    ++row;
  }
  const Eigen::VectorXd error =
      Eigen::Map<const Eigen::VectorXd>(errors.data(), static_cast<Eigen::Index>(errors.size()));
  const Eigen::MatrixXd covariance = result.covariance_within(kept, kept);
  return {error.dot(solve_ldlt(covariance, error)), static_cast<double>(errors.size())};
}

/// Before what growth cannot show was counted (docs/theory/calibration-noise.md, eq. 8b) the squared errors
/// of diameters were up to 30 times those stated, and one run in ten had no answer.
TEST(ShortRun, IsAsSureAsItMayBe) {
  const int trials = test::trials(20, 5);
  for (const ShortCase& c : short_cases()) {
    Machine machine = differential_machine();
    machine.nominal.chassis.noise.wheel_per_sqrt_m = c.file_noise * kWheelNoise;
    Nees sum;
    double log_noise = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      const Driven runs = driven(machine, c.conditions, static_cast<std::uint64_t>(trial));
      const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
      const Nees nees = nees_of(result, machine.truth);
      sum.value += nees.value;
      sum.expected += nees.expected;
      log_noise += std::log(result.calibrated.chassis.noise.wheel_per_sqrt_m / kWheelNoise) / trials;
    }
    std::printf("%-36s NEES %.1f (expected %.0f), learned wheel noise %.2f times the true one\n",
                c.name.c_str(), sum.value, sum.expected, std::exp(log_noise));
    EXPECT_LT(sum.value, chi_squared_limit(1e-3, sum.expected)) << c.name;
    EXPECT_GT(log_noise, std::log(0.8)) << c.name;
    EXPECT_LT(log_noise, std::log(3.0)) << c.name;
  }
}

}  // namespace
}  // namespace trundle::calibration
