// The gyro's bias, a parameter of each recording, where a robot is calibrated by what it sees. The drives
// share no code with the library: calibration/gyro_bias_oracle.hpp.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/calibration/own_biases.hpp"
#include "trundle/slam/smoothing/landmark_calibration.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/gyro_bias_oracle.hpp"
#include "calibration/stated_errors.hpp"
#include "scale.hpp"

namespace trundle::slam {
namespace {

using namespace test::drifting_gyro;

/// By chance once in a thousand of such tests.
constexpr double kChance = 1e-3;

/// Σ over calibrations of squared errors in their sigmas.
struct Consistency {
  double nees = 0.0;  ///< of wheels, track and the gyro's scale
  double nees_expected = 0.0;
  double bias_squares = 0.0;  ///< of the recordings' own
  double biases = 0.0;
  int inside = 0, commons = 0;  ///< of 95 %, of what theirs are about
};

void add(const CalibrationResult& result, const Driven& driven, const Machine& machine, Consistency& sum) {
  for (const ParameterEstimate& e : result.parameters) {
    ASSERT_TRUE(e.observable) << e.name;
    if (e.parameter != kGyroBias) continue;
    // The mean of so few, whose spread was found from them.
    const double t = student_t_limit(0.05, static_cast<double>(driven.recordings.size()) - 1.0);
    const double error = e.value - value_of(e.parameter, machine.truth);
    sum.inside += std::abs(error) <= t * e.sigma_within ? 1 : 0;
    ++sum.commons;
  }
  const test::StatedErrors stated = test::stated_errors(result, machine.truth);
  sum.nees += stated.nees();
  sum.nees_expected += stated.expected_nees();
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    ASSERT_TRUE(result.runs[i].gyro_bias);
    const odometry::GyroBias& bias = *result.runs[i].gyro_bias;
    sum.bias_squares += std::pow(bias.rad_s - driven.bias_rad_s[i], 2) / bias.variance;
    sum.biases += 1.0;
  }
}

CalibrationResult calibrated(const Machine& machine, const Driven& runs) {
  return calibrate_from_landmarks(runs.recordings, {}, machine.nominal);
}

/// With one bias for all the track was off by 4.3 and the gyro's scale by 9 sigmas where biases differ by
/// 0.1°/s.
TEST(LandmarkGyroBias, OfEachRecordingItsOwn) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Machine machine = with_landmark_sensor(differential_machine());
  for (const double spread_deg_s : {0.0, 0.1, 0.5}) {
    Consistency sum;
    for (int trial = 0; trial < test::trials(8, 1); ++trial) {
      const Conditions conditions{.bias_spread_rad_s = spread_deg_s * kDegree, .landmarks = true};
      const Driven runs = driven(machine, conditions, static_cast<std::uint64_t>(trial));
      add(calibrated(machine, runs), runs, machine, sum);
    }
    std::printf("spread %.1f°/s: NEES %.1f (expected %.0f), biases %.2f, %d of %d means\n", spread_deg_s,
                sum.nees, sum.nees_expected, sum.bias_squares / sum.biases, sum.inside, sum.commons);
    EXPECT_LT(sum.nees, chi_squared_limit(kChance, sum.nees_expected));
    EXPECT_GT(sum.nees, chi_squared_limit(1.0 - kChance, sum.nees_expected));
    EXPECT_LT(sum.bias_squares, chi_squared_limit(kChance, sum.biases));
    EXPECT_GE(sum.inside / static_cast<double>(sum.commons),
              0.95 - 3.0 * std::sqrt(0.95 * 0.05 / sum.commons));
  }
}

/// Taken for constant within a recording, the gyro's scale was off by 3.2 sigmas in the mean square, the
/// recordings' biases by 1.4.
TEST(LandmarkGyroBias, WalksWithinARecording) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Conditions conditions{.duration_s = 90.0, .bias_walk = 1e-4, .runs = 2, .landmarks = true};
  const Machine machine = with_bias_walk(conditions.bias_walk, with_landmark_sensor(differential_machine()));
  Consistency sum;
  for (int trial = 0; trial < test::trials(12, 3); ++trial) {
    const Driven runs = driven(machine, conditions, static_cast<std::uint64_t>(trial));
    add(calibrated(machine, runs), runs, machine, sum);
  }
  std::printf("NEES %.1f (expected %.0f), biases %.2f\n", sum.nees, sum.nees_expected,
              sum.bias_squares / sum.biases);
  EXPECT_LT(sum.nees, chi_squared_limit(kChance, sum.nees_expected));
  EXPECT_GT(sum.nees, chi_squared_limit(1.0 - kChance, sum.nees_expected));
  EXPECT_LT(sum.bias_squares, chi_squared_limit(kChance, sum.biases));
}

// Of a wheel whose column is empty no motion is known, and of no motion no walk.
TEST(BiasWalk, OfARecordingWithoutAMotionIsNone) {
  const Machine machine = with_landmark_sensor(differential_machine());
  const Conditions conditions{.runs = 1, .landmarks = true};
  Driven runs = driven(machine, conditions, 1);
  std::ranges::fill(runs.recordings[0].wheels.series[0].value, recording::kNotMeasured);
  EXPECT_THROW(calibrated(machine, runs), CannotAnswer);
}

TEST(LandmarkGyroBias, IsNamedWhereRecordingsDiffer) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Machine machine = with_landmark_sensor(differential_machine());
  Conditions conditions{.bias_spread_rad_s = 0.1 * kDegree, .landmarks = true};
  EXPECT_TRUE(calibrated(machine, driven(machine, conditions, 1)).gyro_biases);
  conditions.bias_spread_rad_s = 0.0;
  EXPECT_FALSE(calibrated(machine, driven(machine, conditions, 1)).gyro_biases);
  // One has none about itself, and a bias that is given is that of all.
  conditions.runs = 1;
  EXPECT_FALSE(calibrated(machine, driven(machine, conditions, 1)).runs.front().gyro_bias);
  conditions.runs = 2;
  const CalibrationResult fixed = calibrate_from_landmarks(driven(machine, conditions, 1).recordings, {},
                                                           machine.truth, {.fix = {"gyro.bias"}});
  for (const RunResult& run : fixed.runs) EXPECT_FALSE(run.gyro_bias);
}

/// Readings of each bias alone, known to σ: the spread that makes them likeliest is √(mean square − σ²).
TEST(OwnBiases, SpreadAsTheLikelihoodOfTheirReadingsHasIt) {
  constexpr double kSigma = 1e-3, kUnit = 0.02;
  OwnBiases own{.unit_rad_s = kUnit};
  double squares = 0.0;
  for (int i = 0; i < 9; ++i) {
    const double reading = 0.001 * (i - 4);
    squares += reading * reading / 9.0;
    own.rad_s.push_back(reading / 2.0);  // a prior of the same σ pulls halfway to 0
  }
  own.rad_s.push_back(std::nullopt);
  own.information = (kUnit / kSigma) * (kUnit / kSigma);
  const Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(9, 9) / (2.0 * own.information);
  const GyroBiasSpread spread = spread_of(own, covariance, 1.0);
  EXPECT_NEAR(spread.found_rad_s, std::sqrt(squares - kSigma * kSigma), 0.02 * spread.found_rad_s);
  EXPECT_GT(spread.prior_rad_s, spread.found_rad_s);
}

}  // namespace
}  // namespace trundle::slam
