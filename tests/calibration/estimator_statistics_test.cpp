// Are the error bars what they say? Hundreds of simulated calibrations: the share of 95 % intervals that
// hold the truth, and the scatter against the Cramér–Rao bound.
#include <algorithm>
#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/simulated_runs.hpp"
#include "held_limits.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using test::prepared;

/// What a series of calibrations of the same robot showed, parameter by parameter.
struct Series {
  Eigen::VectorXd covered;
  Eigen::VectorXd squared_error;
  Eigen::VectorXd bound;  ///< Cramér–Rao variance
  int count = 0;
};

constexpr ReferenceNoise kReferenceNoise = {.position_m = test::kPositionSigma_m,
                                            .heading_rad = test::kHeadingSigma_rad};

Eigen::VectorXd cramer_rao(const std::vector<Run>& runs, const Robot& truth,
                           std::span<const Parameter> parameters) {
  Information information = Information::zero(static_cast<Eigen::Index>(parameters.size()));
  for (const Run& run : runs)
    information.add(
        stream_likelihood(run, without_rounding(truth), parameters, {.reference_noise = kReferenceNoise})
            .total());
  return information.matrix.inverse().diagonal();
}

Series calibrate_often(const Robot& nominal, const Robot& truth, const std::vector<Path>& paths, int times) {
  Series series;
  for (int i = 0; i < times; ++i) {
    std::vector<Run> runs = prepared(nominal, truth, paths, 1000 + static_cast<std::uint64_t>(i));
    const std::vector<Parameter> parameters = default_parameters(nominal, from_outside(runs));
    const auto n = static_cast<Eigen::Index>(parameters.size());
    if (series.count == 0) {
      series.covered = series.squared_error = Eigen::VectorXd::Zero(n);
      series.bound = cramer_rao(runs, truth, parameters);
    }
    const Estimate estimate = estimate_parameters({runs, nominal, parameters});
    for (Eigen::Index j = 0; j < n; ++j) {
      const Parameter& parameter = parameters[static_cast<std::size_t>(j)];
      const double error = value_of(parameter, estimate.robot) - value_of(parameter, truth);
      series.squared_error[j] += error * error;
      if (std::abs(error) <= 1.959964 * std::sqrt(estimate.covariance(j, j))) series.covered[j] += 1.0;
    }
    ++series.count;
  }
  series.covered /= series.count;
  series.squared_error /= series.count;
  return series;
}

void expect_honest(const Series& series) {
  constexpr double kBeyond3Sigma = 0.00135;
  const auto [least, most] = test::held_limits(series.count);
  // A tenth, or of few calibrations what a variance of so many scatters by.
  const double n = series.count;
  const double narrowest = std::min(0.90, std::sqrt(chi_squared_limit(1.0 - kBeyond3Sigma, n) / n));
  const double widest = std::max(1.10, std::sqrt(chi_squared_limit(kBeyond3Sigma, n) / n));
  for (Eigen::Index j = 0; j < series.covered.size(); ++j) {
    EXPECT_GE(series.covered[j], least - 1e-9) << "parameter " << j;
    EXPECT_LE(series.covered[j], most + 1e-9) << "parameter " << j;
    const double scatter = std::sqrt(series.squared_error[j] / series.bound[j]);
    EXPECT_LE(scatter, widest) << "parameter " << j;
    EXPECT_GE(scatter, narrowest) << "parameter " << j;
    ::testing::Test::RecordProperty("coverage_" + std::to_string(j), std::to_string(series.covered[j]));
    std::printf("parameter %d: coverage %.3f, scatter / bound %.3f\n", static_cast<int>(j), series.covered[j],
                scatter);
  }
}

TEST(EstimatorStatistics, DifferentialDriveIntervalsAndScatter) {
  expect_honest(calibrate_often(test::nominal_differential(), test::true_differential(),
                                test::differential_paths(), test::trials(600, 3)));
}

TEST(EstimatorStatistics, Omni3IntervalsAndScatter) {
  expect_honest(
      calibrate_often(test::nominal_omni3(), test::true_omni3(), test::omni_paths(), test::trials(600, 3)));
}

}  // namespace
}  // namespace trundle::calibration
