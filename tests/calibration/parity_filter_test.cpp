// What no motion explains of a run's readings beside its reference: both are of the same readings.
#include <functional>
#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/calibration/likelihood/run_likelihood.hpp"
#include "trundle/chassis/usual_parameters.hpp"
#include "trundle/simulation/path.hpp"

#include "calibration/simulated_runs.hpp"
#include "calibration/steered_drives.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

/// A robot, what is estimated of it, and drives of it, each by a seed.
struct Drives {
  Robot truth;
  std::vector<Parameter> parameters;
  std::function<std::vector<Run>(int)> runs;
};

Drives steered(std::string_view kind) {
  const Robot nominal = test::steered_robot(kind);
  const auto runs = [kind](int i) { return test::steered_runs(kind, true, i); };
  return {test::off(nominal), default_parameters(nominal, from_outside(runs(0))), runs};
}

/// Three omni wheels, one of which is four times as bad as another, and a gyro.
Drives uneven_omni3() {
  Robot truth = test::nominal_omni3();
  truth.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 0.002, .bias_walk_rad_s_sqrt_s = 0.0};
  const double noise[] = {0.004, 0.015, 0.006};
  for (std::size_t w = 0; w < 3; ++w) truth.chassis.wheels()[w].noise_per_sqrt_m = noise[w];
  const auto runs = [truth](int i) {
    const auto seed = static_cast<std::uint64_t>(i);
    statistics::Random random(seed, 7);
    const Path tour = simulation::random_tour({.length_m = 30.0}, {}, random, {.forward_m_s = 0.5});
    Scenario scenario = test::scenario_of(truth, truth, tour, seed);
    scenario.encoders = {.rate_hz = 20.0, .unit = WheelUnit::radians};
    return std::vector<Run>{prepare_run(simulate(scenario).recording, truth)};
  };
  return {truth, default_parameters(truth, from_outside(runs(0))), runs};
}

class ParityFilterTest : public testing::TestWithParam<Drives (*)()> {};

// An estimate from the scores of the truth, A⁻¹ g, scatters by A⁻¹ about it. With parity residuals taken for
// independent the variances of a car were 1.46 of the track, 0.52 of the wheelbase; with sensitivities to
// them taken for exact the wheels of the uneven robot were two sigmas off.
TEST_P(ParityFilterTest, ScoresOfTheTruthScatterAsTheySay) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  constexpr int kDrives = 150;
  const Drives drives = GetParam()();
  const auto n = static_cast<Eigen::Index>(drives.parameters.size());
  Information sum = Information::zero(n);
  Eigen::MatrixXd scatter = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < kDrives; ++i) {
    Information drive = Information::zero(n);
    for (const calibration::Run& run : drives.runs(i)) {
      LikelihoodOptions options;
      options.reference_noise.position_m = test::kPosition_m;
      options.reference_noise.heading_rad = test::kHeading_rad;
      options.redundant.emplace(RedundantReadings{drives.truth, {}});
      drive.add(stream_likelihood(run, drives.truth, drives.parameters, options).total());
    }
    scatter += drive.gradient * drive.gradient.transpose() / kDrives;
    sum.add(drive);
  }
  const Eigen::MatrixXd shown = sum.matrix / kDrives;
  Eigen::MatrixXd information = shown;
  for (Eigen::Index j = 0; j < n; ++j) {
    const double prior = prior_sigma(drives.parameters[static_cast<std::size_t>(j)], drives.truth);
    information(j, j) += 1.0 / (prior * prior);
  }
  const Eigen::MatrixXd covariance = information.inverse();
  const Eigen::MatrixXd estimates = covariance * scatter * covariance;
  // The truth stands where the prior has it each time: what that says of an estimate does not scatter.
  const Eigen::MatrixXd expected = covariance * shown * covariance;
  const Eigen::VectorXd mean = covariance * sum.gradient / kDrives;
  const double chance = 4.0 / std::sqrt(kDrives);
  for (Eigen::Index j = 0; j < n; ++j) {
    const std::string name = name_of(drives.parameters[static_cast<std::size_t>(j)], drives.truth);
    const double stated = covariance(j, j), variance = estimates(j, j) / stated;
    std::printf("%s: variance %.2f, mean %+.2f sigmas\n", name.c_str(), variance,
                mean[j] / std::sqrt(stated));
    EXPECT_NEAR(variance, expected(j, j) / stated, std::sqrt(2.0) * chance) << name;
    EXPECT_LT(std::abs(mean[j]) / std::sqrt(stated), chance) << name;
  }
  EXPECT_NEAR(sum.chi2 / sum.count, 1.0, 0.05);
}

INSTANTIATE_TEST_SUITE_P(Robots, ParityFilterTest,
                         testing::Values(
                             +[] { return steered("tricycle"); }, +[] { return steered("car"); },
                             +[] { return steered("sliding car"); }, &uneven_omni3));

}  // namespace
}  // namespace trundle::calibration
