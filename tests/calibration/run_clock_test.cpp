// The clock of a run's reference, a parameter of that run.
#include "trundle/calibration/problem/run_clock.hpp"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/geometry/decompositions.hpp"

#include "calibration/simulated_runs.hpp"
#include "recording/cut.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using test::differential_paths;
using test::nominal_differential;
using test::true_differential;

/// Blocks of random residuals of three parameters and a clock.
std::vector<Information> random_blocks(Random& random) {
  std::vector<Information> blocks;
  for (int i = 0; i < 3; ++i) {
    Information block = Information::zero(4);
    Eigen::MatrixXd J(5, 4);
    Eigen::VectorXd nu(5);
    for (double& value : J.reshaped()) value = random.normal();
    for (double& value : nu) value = random.normal();
    block.add(J, Eigen::MatrixXd::Identity(5, 5), nu);
    blocks.push_back(std::move(block));
  }
  return blocks;
}

Information sum_of(const std::vector<Information>& blocks) {
  Information sum = Information::zero(blocks.front().gradient.size());
  for (const Information& block : blocks) sum.add(block);
  return sum;
}

OwnParameter a_clock(double moved_s) {
  return {Parameter{ParameterKind::time_offset, -1}, kClockPrior_s, moved_s};
}

TEST(RunClock, EliminatedItIsTheMinimumOverIt) {
  Random random(7, 1);
  constexpr double kMoved_s = 0.3;
  const std::vector<Information> blocks = random_blocks(random);
  const Information all = sum_of(blocks), rest = sum_of(without_own(blocks, {{a_clock(kMoved_s)}}));
  // χ²(p, t) of all, with the prior of the clock, minimised over t by brute force.
  const auto chi2_at = [&](const Eigen::Vector3d& p) {
    double least = std::numeric_limits<double>::infinity();
    for (double t = -3.0; t < 3.0; t += 1e-4) {
      const Eigen::Vector4d x(p.x(), p.y(), p.z(), t);
      const double from_prior = (kMoved_s + t) / kClockPrior_s;
      least = std::min(
          least, all.chi2 - 2.0 * all.gradient.dot(x) + x.dot(all.matrix * x) + from_prior * from_prior);
    }
    return least;
  };
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0.0, 0.0, 0.0), Eigen::Vector3d(0.2, -0.1, 0.3), Eigen::Vector3d(-0.5, 0.4, 0.1)})
    EXPECT_NEAR(rest.chi2 - 2.0 * rest.gradient.dot(p) + p.dot(rest.matrix * p), chi2_at(p), 1e-6);
}

TEST(RunClock, ItFollowsTheOthersToWhereItFitsBest) {
  Random random(8, 1);
  const Information all = sum_of(random_blocks(random));
  const double step_s = own_step(all, {{a_clock(0.0)}}).step[0];
  const double slope = all.gradient[3] - step_s * all.matrix(3, 3) - step_s / (kClockPrior_s * kClockPrior_s);
  EXPECT_NEAR(slope, 0.0, 1e-12);
}

/// Tours whose references are early, each by its own.
std::vector<Recording> recorded_with_clocks(const std::vector<double>& clock_s, std::uint64_t seed) {
  std::vector<Recording> recordings;
  for (std::size_t i = 0; i < clock_s.size(); ++i) {
    Random random(seed + i, 5);
    Scenario scenario = test::scenario_of(nominal_differential(), true_differential(),
                                          random_tour({.length_m = 15.0}, {}, random), seed + i);
    scenario.encoders.rate_hz = 20.0;
    scenario.reference.rate_hz = 20.0;
    Recording recording = simulate(scenario).recording;
    recording.name = "run " + std::to_string(i);
    recording.session = "one";
    for (double& time_s : recording.reference.time_s) time_s -= clock_s[i];
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

TEST(RunClock, IsFoundInEachRunAndItsIntervalHoldsIt) {
  const std::vector<double> truth = {0.25, -0.3, 0.5, -0.2};
  const int trials = test::trials(20, 2);
  double squares = 0.0;
  int clocks = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const CalibrationResult result =
        calibrate(recorded_with_clocks(truth, 300 + 10 * static_cast<std::uint64_t>(trial)), {},
                  nominal_differential(), {});
    for (std::size_t i = 0; i < result.runs.size(); ++i) {
      ASSERT_TRUE(result.runs[i].reference_clock);
      const TimeOffset& clock = *result.runs[i].reference_clock;
      const double error = (clock.offset_s - truth[i]) / clock.sigma_s;
      EXPECT_LT(clock.sigma_s, 0.03);
      squares += error * error;
      ++clocks;
    }
  }
  const double mean = squares / clocks;
  std::printf("%d clocks: mean squared error over variance %.2f\n", clocks, mean);
  EXPECT_NEAR(mean, 1.0, 4.0 * std::sqrt(2.0 / clocks));
}

TEST(RunClock, WhereTheMotionDoesNotTellItStaysAsGiven) {
  std::vector<Recording> recordings =
      test::recorded(nominal_differential(), true_differential(), differential_paths(), 1);
  recordings.push_back(recorded_with_clocks({0.25}, 1).front());
  const Recording& still = recordings.front();
  for (auto* values : {&recordings.front().reference.x_m, &recordings.front().reference.y_m})
    for (double& value : *values) value = kNotMeasured;  // a reference of headings alone
  const CalibrationResult result = calibrate(recordings, {}, nominal_differential(), {});
  ASSERT_EQ(result.runs.front().name, still.name);
  EXPECT_FALSE(result.runs.front().reference_clock);
  EXPECT_TRUE(result.runs.back().reference_clock);
}

TEST(RunClock, RunsTooShortForOneOfTheirOwnShareIt) {
  std::vector<Recording> pieces;
  for (const Recording& whole : recorded_with_clocks({0.2, 0.2}, 21))
    for (double start_s = 0.0; start_s < 30.0; start_s += 3.0) {
      pieces.push_back(test::cut(whole, start_s, start_s + 2.5));
      pieces.back().name += fmt::format(" from {} s", start_s);
    }
  const CalibrationResult result = calibrate(pieces, {}, nominal_differential(), {});
  ASSERT_TRUE(result.reference_clocks);
  EXPECT_THAT(*result.reference_clocks, testing::HasSubstr("together"));
  EXPECT_NEAR(result.calibrated.reference_time_offset_s, 0.2, 0.05);
}

TEST(RunClock, WhatIsLessThanAStampSaysIsSharedByAllRuns) {
  // Rows of 0.05 s: 0.1 s would be needed for one run alone.
  const CalibrationResult late =
      calibrate(recorded_with_clocks({0.05, 0.05, 0.05}, 31), {}, nominal_differential(), {});
  EXPECT_NEAR(late.calibrated.reference_time_offset_s, 0.05, 0.01);
  EXPECT_THAT(late.reference_clocks.value_or(""), testing::HasSubstr("in 3 runs together"));
  for (const ParameterEstimate& e : late.parameters)
    EXPECT_NEAR(e.value, value_of(e.parameter, true_differential()), 4.0 * e.sigma_within) << e.name;
  const CalibrationResult right =
      calibrate(recorded_with_clocks({0.0, 0.0, 0.0}, 31), {}, nominal_differential(), {});
  EXPECT_EQ(right.calibrated.reference_time_offset_s, 0.0);
}

TEST(RunClock, OffsetsThatContradictOneAnotherAreNotShared) {
  // As if each run's stamps had been laid on those of its reference by hand. Their mean alone is off.
  const CalibrationResult result =
      calibrate(recorded_with_clocks({0.0, 0.08, 0.03, 0.06}, 41), {}, nominal_differential(), {});
  EXPECT_EQ(result.calibrated.reference_time_offset_s, 0.0);
  EXPECT_FALSE(result.reference_clocks);
}

TEST(RunClock, OneOffsetForAllIsNotSoughtTwice) {
  auto runs = test::prepared(nominal_differential(), true_differential(), differential_paths(), 4);
  runs[0].reference_clock = TimeOffset{.offset_s = 0.2};
  EXPECT_TRUE(has_own_clock(runs[0], default_parameters(nominal_differential(), from_outside(runs))));
  EXPECT_FALSE(has_own_clock(runs[0], with_own({}, {{a_clock(0.0)}})));
}

}  // namespace
}  // namespace trundle::calibration
