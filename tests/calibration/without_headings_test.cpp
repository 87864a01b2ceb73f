// References that have positions alone, of robots that can drive any way.
#include <cstdio>
#include <vector>

#include <Eigen/Eigenvalues>
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

struct Squares {
  double nees = 0.0;
  double expected = 0.0;
};

/// Of all but the gyro's bias, which walks; of directions what they differ from their mean by, which no path
/// shows.
Squares squares_of(const CalibrationResult& result, const Machine& machine) {
  test::StatedErrors stated = test::stated_errors(result, machine.truth);
  std::vector<Eigen::Index> directions;
  for (std::size_t i = 0; i < stated.parameters.size(); ++i)
    if (stated.parameters[i].parameter.kind == ParameterKind::direction)
      directions.push_back(static_cast<Eigen::Index>(i));
  Eigen::VectorXd& error = stated.error;
  error(directions).array() -= error(directions).mean();
  const Eigen::MatrixXd& covariance = stated.covariance;
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseSqrt();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      covariance.cwiseQuotient(sigma * sigma.transpose()));
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * error.cwiseQuotient(sigma);
  Squares squares;
  for (Eigen::Index i = 1; i < along.size(); ++i) {  // the first is the common direction, of no variance
    squares.nees += along[i] * along[i] / eigen.eigenvalues()[i];
    squares.expected += 1.0;
  }
  return squares;
}

/// It went round by whole radians, with a sigma of a tenth.
TEST(WithoutHeadings, WhatIsAheadStaysAsGiven) {
  const int trials = test::trials(4, 1);
  const double rate_hz = test::kSanitizers ? 10.0 : 50.0;  // more readings are the same arithmetic once more
  for (const Machine& machine : {omni_machine(), pods_machine()}) {
    Squares all;
    for (int trial = 0; trial < trials; ++trial) {
      const Driven runs = driven(machine, {.rate_hz = rate_hz, .headings = false, .runs = 3},
                                 static_cast<std::uint64_t>(trial));
      const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
      EXPECT_THAT(result.unobservable,
                  testing::Contains(testing::HasSubstr("in common: not observable from these runs: measure "
                                                       "headings too")));
      const Squares squares = squares_of(result, machine);
      all.nees += squares.nees;
      all.expected += squares.expected;
    }
    std::printf("%s: NEES %.1f, expected %.0f\n", machine.nominal.wheel_names.front().c_str(), all.nees,
                all.expected);
    EXPECT_LT(all.nees, chi_squared_limit(1e-3, all.expected));
  }
}

/// As GPS shows them. Before the heading at the start was a parameter of its run, diameters were 0.8 sigmas
/// too small in the mean: the first positions turn a heading that is not known, and the path with it.
TEST(WithoutHeadings, CoarsePositionsBendNoPath) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int trials = test::trials(40, 2);
  const Machine machine = differential_machine();
  double mean = 0.0, square = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const Driven runs =
        driven(machine, {.duration_s = 25.0, .headings = false, .position_sigma_m = 0.05, .runs = 2},
               static_cast<std::uint64_t>(trial));
    const CalibrationResult result = calibrate(runs.recordings, {}, machine.nominal);
    for (const ParameterEstimate& found : result.parameters) {
      if (found.parameter.kind != ParameterKind::diameter) continue;
      const double z = (found.value - value_of(found.parameter, machine.truth)) / found.sigma_total;
      mean += z / (2 * trials);
      square += z * z / (2 * trials);
    }
  }
  std::printf("diameters: mean %+.2f sigmas, mean square %.2f\n", mean, square);
  // Both of a robot err alike.
  EXPECT_LT(std::abs(mean), normal_limit(1e-3) / std::sqrt(trials));
  EXPECT_LT(square, chi_squared_limit(1e-3, trials) / trials);
}

}  // namespace
}  // namespace trundle::calibration
