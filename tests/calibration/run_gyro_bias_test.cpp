// The gyro's bias, a parameter of each run: what its drift from run to run does to everything else.
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/likelihood/run_parameters.hpp"
#include "trundle/calibration/problem/bias_walk.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/slip/find_slip.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "calibration/gyro_bias_oracle.hpp"
#include "calibration/stated_errors.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test::drifting_gyro;

/// By chance once in a thousand of such tests.
constexpr double kChance = 1e-3;

TEST(RunParameters, EliminatedTogetherTheyAreTheMinimumOverThem) {
  statistics::Random random(11, 1);
  Information all = Information::zero(5);
  for (int i = 0; i < 3; ++i) {
    Eigen::MatrixXd J(6, 5);
    Eigen::VectorXd nu(6);
    for (double& value : J.reshaped()) value = random.normal();
    for (double& value : nu) value = random.normal();
    all.add(J, Eigen::MatrixXd::Identity(6, 6), nu);
  }
  const std::vector<OwnParameter> own = {{kGyroBias, 0.3, 0.2},
                                         {Parameter{ParameterKind::time_offset, -1}, 0.7, -0.1}};
  Information rest = Information::zero(3);
  for (const Information& part : without_own({all}, own)) rest.add(part);
  // With the priors' two residuals, minimised by the normal equations of all five.
  Information full = all;
  for (std::size_t i = 0; i < own.size(); ++i) {
    Eigen::RowVectorXd J = Eigen::RowVectorXd::Zero(5);
    J[3 + static_cast<Eigen::Index>(i)] = 1.0;
    full.add(J, Eigen::Matrix<double, 1, 1>(1.0 / std::pow(own[i].prior_sigma, 2)),
             Eigen::Matrix<double, 1, 1>(-own[i].moved));
  }
  const Eigen::MatrixXd covariance = inverse_of(full.matrix);
  EXPECT_TRUE(inverse_of(rest.matrix).isApprox(covariance.topLeftCorner(3, 3), 1e-9));
  EXPECT_TRUE(solve_ldlt(rest.matrix, rest.gradient).isApprox((covariance * full.gradient).head(3), 1e-9));
  EXPECT_NEAR(rest.chi2 - rest.gradient.dot(solve_ldlt(rest.matrix, rest.gradient)),
              full.chi2 - full.gradient.dot(covariance * full.gradient), 1e-9);
  EXPECT_EQ(rest.count, full.count);
}

/// A Wiener process less its mean over 0 ≤ t ≤ T has the variance T (1/3 − u + u²) at u = t/T.
TEST(BiasWalk, SpreadsAsAWienerProcessAboutItsMean) {
  const BiasWalk walk =
      bias_walk_of({.noise_rad_s_sqrt_hz = 1e-9, .bias_walk_rad_s_sqrt_s = 2e-5}, 100.0, 400.0);
  for (const double u : {0.0, 0.3, 0.5, 1.0})
    EXPECT_NEAR(walk.at(100.0 + 300.0 * u).squaredNorm(), 2e-5 * 2e-5 * 300.0 * (1.0 / 3.0 - u + u * u),
                0.03 * 2e-5 * 2e-5 * 300.0);
}

TEST(BiasWalk, HasTheHarmonicsThatRiseAboveTheNoise) {
  const auto harmonics = [](double noise, double walk, double duration_s) {
    return bias_walk_of({.noise_rad_s_sqrt_hz = noise, .bias_walk_rad_s_sqrt_s = walk}, 0.0, duration_s)
        .harmonics;
  };
  EXPECT_EQ(harmonics(3e-4, 1e-5, 40.0), 0);
  EXPECT_EQ(harmonics(3e-4, 1e-5, 600.0), 12);
  EXPECT_EQ(harmonics(3e-4, 0.0, 600.0), 0);
  EXPECT_EQ(harmonics(0.0, 1e-5, 600.0), 30);
}

/// Σ over calibrations of what errors are in their sigmas.
struct Consistency {
  double nees = 0.0;  ///< of all parameters but the gyro's bias, which is another one in each run
  double nees_expected = 0.0;
  double bias_squares = 0.0;  ///< of the runs' own
  int biases = 0;
  int inside = 0, intervals = 0;  ///< of 95 %
  int next_inside = 0, next = 0;  ///< of the bias of a further run
  std::vector<double> wheel_noise;
};

void add(const CalibrationResult& result, const Driven& driven, const Machine& machine, Consistency& sum) {
  const test::StatedErrors stated = test::stated_errors(result, machine.truth);
  for (std::size_t i = 0; i < stated.parameters.size(); ++i) {
    ++sum.intervals;
    const double error = stated.error[static_cast<Eigen::Index>(i)];
    sum.inside += std::abs(error) <= kNormalAt95 * stated.parameters[i].sigma_within ? 1 : 0;
  }
  sum.nees += stated.nees();
  sum.nees_expected += stated.expected_nees();
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    ASSERT_TRUE(result.runs[i].gyro_bias);
    const GyroBias& bias = *result.runs[i].gyro_bias;
    sum.bias_squares += std::pow(bias.rad_s - driven.bias_rad_s[i], 2) / bias.variance;
    ++sum.biases;
  }
  sum.wheel_noise.push_back(result.calibrated.chassis.noise.wheel_per_sqrt_m);
}

const ParameterEstimate& bias_of(const CalibrationResult& result) {
  return *std::ranges::find(result.parameters, kGyroBias, &ParameterEstimate::parameter);
}

Consistency calibrated(const Machine& machine, const Conditions& conditions, int trials) {
  Consistency sum;
  for (int trial = 0; trial < trials; ++trial) {
    const auto seed = static_cast<std::uint64_t>(trial);
    const Driven runs = driven(machine, conditions, seed);
    const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
    add(result, runs, machine, sum);
    std::mt19937_64 random(77 + seed);
    const double next = kMeanBias + conditions.bias_spread_rad_s * std::normal_distribution<double>()(random);
    const auto bias = std::ranges::find(result.parameters, kGyroBias, &ParameterEstimate::parameter);
    if (bias == result.parameters.end()) continue;  // it did not hold beyond its runs, and stays as given
    const double t = student_t_limit(0.05, static_cast<double>(runs.recordings.size()) - 1.0);
    sum.next_inside += std::abs(next - bias->value) <= t * bias->sigma_total ? 1 : 0;
    ++sum.next;
  }
  return sum;
}

void expect_consistent(const std::string& what, const Consistency& sum) {
  const double share = static_cast<double>(sum.inside) / sum.intervals;
  const double biases = sum.bias_squares / sum.biases;
  std::printf("%-44s NEES %.1f (expected %.0f), %.1f %% of %d intervals, biases %.2f\n", what.c_str(),
              sum.nees, sum.nees_expected, 100.0 * share, sum.intervals, biases);
  EXPECT_LT(sum.nees, chi_squared_limit(kChance, sum.nees_expected)) << what;
  EXPECT_GT(sum.nees, chi_squared_limit(1.0 - kChance, sum.nees_expected)) << what;
  EXPECT_GE(sum.next_inside / static_cast<double>(sum.next), 0.93 - 3.0 * std::sqrt(0.95 * 0.05 / sum.next))
      << what;
}

struct Case {
  const char* what;
  Machine machine;
  Conditions conditions;
  int trials;
};

std::vector<Case> cases(double spread_deg_s) {
  const double s = spread_deg_s * kDegree;
  std::vector<Case> cases = {
      {"differential, 10 Hz", differential_machine(), {.bias_spread_rad_s = s}, 12},
      {"differential, no rests, no headings",
       differential_machine(),
       {.bias_spread_rad_s = s, .headings = false, .rests = false},
       8},
      {"three omni wheels", omni_machine(), {.bias_spread_rad_s = s, .sessions = 2, .runs = 2}, 4},
      {"two passive wheels, nothing redundant", pods_machine(), {.bias_spread_rad_s = s}, 4}};
  if (spread_deg_s < 0.1) return cases;
  cases.push_back(
      {"two passive wheels, no rests", pods_machine(), {.bias_spread_rad_s = s, .rests = false}, 4});
  cases.push_back({"differential, 50 Hz, no headings",
                   differential_machine(),
                   {.rate_hz = 50, .bias_spread_rad_s = s, .headings = false},
                   3});
  cases.push_back({"differential, 200 Hz, two sessions",
                   differential_machine(),
                   {.rate_hz = 200, .bias_spread_rad_s = s, .sessions = 2, .runs = 2},
                   1});
  return cases;
}

void expect_consistent_with(double spread_deg_s) {
  Consistency all;
  for (Case& one : cases(spread_deg_s)) {
    const Machine machine = with_good_gyro(one.machine, one.conditions);
    const Consistency sum = calibrated(machine, one.conditions, test::trials(one.trials, 1));
    expect_consistent(one.what, sum);
    all.inside += sum.inside;
    all.intervals += sum.intervals;
    all.bias_squares += sum.bias_squares;
    all.biases += sum.biases;
  }
  const double share = static_cast<double>(all.inside) / all.intervals;
  const double chance = 3.0 * std::sqrt(0.95 * 0.05 / all.intervals);
  std::printf("%.1f %% of %d intervals hold the truth\n", 100.0 * share, all.intervals);
  EXPECT_GE(share, 0.93 - chance);
  EXPECT_LE(share, 0.97 + chance);
  EXPECT_LT(all.bias_squares, chi_squared_limit(kChance, all.biases));
}

TEST(RunGyroBias, AlikeInAllRuns) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_consistent_with(0.0);
}
TEST(RunGyroBias, ALittleDifferent) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_consistent_with(0.02);
}
/// Ten times what is usual: with a bias that is constant over a run the runs' biases, which are their means,
/// were 1.8 sigmas off.
TEST(RunGyroBias, WalksWithinARun) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Conditions conditions{.duration_s = 120.0, .bias_walk = 1e-4, .runs = 3};
  const Consistency sum =
      calibrated(with_bias_walk(1e-4, differential_machine()), conditions, test::trials(16, 6));
  expect_consistent("differential, a bias that walks", sum);
  EXPECT_LT(sum.bias_squares, chi_squared_limit(kChance, sum.biases));
}
/// Of more harmonics than are parameters of a run: the stamps of its gyro, which move, are kept in a run of
/// their own.
TEST(RunGyroBias, WalksWhereTheGyrosClockIsSoughtToo) {
  const Machine machine = with_bias_walk(1e-4, differential_machine());
  const Conditions conditions{.duration_s = 90.0, .bias_walk = 1e-4, .runs = 2};
  const CalibrationResult result = calibrate(driven(machine, conditions, 1).recordings, {}, machine.nominal,
                                             {.free = {"gyro.time_offset"}});
  const auto offset = std::ranges::find(result.parameters, "gyro.time_offset", &ParameterEstimate::name);
  ASSERT_NE(offset, result.parameters.end());
  EXPECT_NEAR(offset->value, 0.0, 5.0 * offset->sigma_within);
}
TEST(RunGyroBias, DifferentByATenthOfADegreePerSecond) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  expect_consistent_with(0.1);
}

double mean_of_logs(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += std::log(value);
  return sum / static_cast<double>(values.size());
}

double sigma_of_logs(const std::vector<double>& values) {
  const double mean = mean_of_logs(values);
  double sum = 0.0;
  for (const double value : values) sum += std::pow(std::log(value) - mean, 2);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

/// As it is with one bias for all: to less than it scatters from one set of runs to another.
TEST(RunGyroBias, DoesNotPassForNoiseOfTheWheels) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int trials = test::trials(8, 4);
  for (const bool rests : {true, false}) {
    std::vector<std::vector<double>> noise;
    for (const double spread_deg_s : {0.0, 0.1, 1.0}) {
      Conditions conditions{.bias_spread_rad_s = spread_deg_s * kDegree, .rests = rests};
      const Machine machine = with_good_gyro(differential_machine(), conditions);
      noise.push_back(calibrated(machine, conditions, trials).wheel_noise);
    }
    const double sigma = sigma_of_logs(noise.front());
    std::printf("wheel noise %.5f, scatter %.0f %%\n", std::exp(mean_of_logs(noise.front())), 100.0 * sigma);
    EXPECT_LT(sigma, 0.3);
    for (const std::vector<double>& drifting : noise) {
      EXPECT_NEAR(mean_of_logs(drifting), mean_of_logs(noise.front()), 0.2 * sigma);
      for (const double one : drifting)
        EXPECT_NEAR(std::log(one / kWheelNoise), 0.0, normal_limit(kChance) * sigma);
    }
  }
}

/// A robot calibrated on runs of other biases finds a slip of 20 cm in a run of again another one, and raises
/// no more alarms than one interval of a hundred.
TEST(RunGyroBias, SlipIsFoundInARunOfAnotherOne) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  for (const bool rests : {true, false}) {
    const Machine machine = differential_machine();
    Conditions conditions{.bias_spread_rad_s = 0.1 * kDegree, .rests = rests};
    const int trials = test::trials(6, 1);
    int found = 0;
    std::size_t alarms = 0, judged = 0;
    for (int trial = 0; trial < trials; ++trial) {
      const auto seed = static_cast<std::uint64_t>(trial);
      const Robot robot =
          calibrate(driven(machine, conditions, seed).recordings, {}, machine.nominal).calibrated;
      Conditions later = conditions;
      later.runs = 1;
      const auto clean = driven(machine, later, 100 + seed);
      const slip::SlipReport quiet = slip::find_slip(align(clean.recordings[0], robot), {}, robot);
      alarms += quiet.counts.alarms;
      judged += quiet.counts.judged;
      later.slip_m = 0.2;
      const auto slipping = driven(machine, later, 100 + seed);
      const slip::SlipReport report = slip::find_slip(align(slipping.recordings[0], robot), {}, robot);
      // One reading more than unknowns does not say which of the two wheels it was.
      found += std::ranges::any_of(report.events,
                                   [](const slip::SlipEvent& event) {
                                     return std::abs(std::abs(event.excess_m) - 0.2) <
                                            4.0 * event.excess_sigma_m + 0.01;
                                   })
                   ? 1
                   : 0;
    }
    EXPECT_EQ(found, trials);
    const double expected = 0.01 * static_cast<double>(judged);
    std::printf("%d of %d slips, %zu alarms of %.0f expected\n", found, trials, alarms, expected);
    EXPECT_LE(static_cast<double>(alarms), expected + 3.0 * std::sqrt(expected));
  }
}

TEST(RunGyroBias, IsNamedWhereRunsDifferAndStandsInTheRobotFile) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Machine machine = differential_machine();
  const auto result_with = [&](double spread_deg_s) {
    return calibrate(driven(machine, {.bias_spread_rad_s = spread_deg_s * kDegree}, 3).recordings, {},
                     machine.nominal);
  };
  const CalibrationResult alike = result_with(0.0);
  EXPECT_FALSE(alike.gyro_biases);
  const CalibrationResult different = result_with(0.1);
  ASSERT_TRUE(different.gyro_biases);
  EXPECT_THAT(*different.gyro_biases, testing::HasSubstr("run 0/3"));
  EXPECT_THAT(different.notes, testing::Contains(*different.gyro_biases));
  const ParameterEstimate& bias = bias_of(different);
  double mean = 0.0;
  for (const RunResult& run : different.runs) mean += run.gyro_bias->rad_s / 4.0;
  EXPECT_NEAR(bias.value, mean, 0.1 * bias.sigma_within);
  EXPECT_NEAR(different.calibrated.chassis.gyro->bias_rad_s, bias.value, 1e-12);
  ASSERT_TRUE(bias.sigma_between);
  EXPECT_GT(*bias.sigma_between, 10.0 * bias_of(alike).sigma_total);
  EXPECT_GE(bias.sigma_total, *bias.sigma_between);
  // Nothing else is less known for it.
  for (std::size_t j = 0; j < alike.parameters.size(); ++j) {
    if (alike.parameters[j].parameter == kGyroBias) continue;
    EXPECT_NEAR(different.parameters[j].sigma_within / alike.parameters[j].sigma_within, 1.0, 0.1);
  }
}

TEST(RunGyroBias, OneThatIsFixedIsThatOfAllRuns) {
  const Machine machine = differential_machine();
  const CalibrationResult result =
      calibrate(driven(machine, {.bias_spread_rad_s = 0.02 * kDegree}, 3).recordings, {}, machine.truth,
                {.fix = {"gyro.bias"}});
  EXPECT_FALSE(result.gyro_biases);
  for (const RunResult& run : result.runs) EXPECT_FALSE(run.gyro_bias);
}

/// In a few seconds a bias is not told from noise.
TEST(RunGyroBias, ShortRunsHaveOneBias) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Machine machine = differential_machine();
  const Conditions conditions{.duration_s = 9.0, .rests = false, .runs = 8};
  const CalibrationResult result = calibrate(driven(machine, conditions, 6).recordings, {}, machine.nominal);
  for (const RunResult& run : result.runs) EXPECT_FALSE(run.gyro_bias);
}

/// By its rests, as odometry learns it: the reference is not asked.
TEST(RunGyroBias, ARunThatIsHeldOutLearnsIt) {
  const Machine machine = differential_machine();
  const Driven runs = driven(machine, {.bias_spread_rad_s = 0.1 * kDegree}, 5);
  Conditions warm{.runs = 1};
  std::vector<Recording> later = {Drive(machine, warm, kMeanBias + 0.5 * kDegree, 1).record()};
  const CalibrationResult result = calibrate(runs.recordings, later, machine.nominal);
  const RunResult& held_out = result.runs.back();
  ASSERT_TRUE(held_out.hold_out && held_out.after);
  EXPECT_FALSE(held_out.gyro_bias);
  // With the bias of the others it turns by 0.6 rad and more.
  EXPECT_LT(held_out.after->heading_rms_rad, 0.02);
  ASSERT_TRUE(result.cross_validation);
  EXPECT_LT(result.cross_validation->calibrated_m, 0.5 * result.cross_validation->given_m);
}

}  // namespace
}  // namespace trundle::calibration
