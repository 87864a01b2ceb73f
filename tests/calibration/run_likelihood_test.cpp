#include "trundle/calibration/likelihood/run_likelihood.hpp"

#include <gtest/gtest.h>

#include "calibration/simulated_runs.hpp"

namespace trundle::calibration {
namespace {

// From the middle on the reference is elsewhere, by less than passes for a jump. The filter that leaves out
// what contradicts it would leave out all that follows.
TEST(RunLikelihood, WhatTwoEpochsInARowContradictIsTheFilter) {
  auto run =
      test::prepared(test::nominal_differential(), test::true_differential(), test::differential_paths(), 4)
          .front();
  const double middle_s = run.epoch_time(run.epochs.size() / 2);
  for (std::size_t i = 0; i < run.reference.time_s.size(); ++i)
    if (run.reference.time_s[i] > middle_s - 0.5) run.reference.x_m[i] += 0.08;
  ASSERT_TRUE(run.jumps.empty());
  ASSERT_GT(run.epochs.size(), 20U);
  const RunLikelihood likelihood = stream_likelihood(
      run, test::true_differential(), {},
      {.reference_noise = {.position_m = test::kPositionSigma_m, .heading_rad = test::kHeadingSigma_rad},
       .gate = 30.0});
  ASSERT_EQ(likelihood.outliers.size(), 2U);
  EXPECT_EQ(likelihood.outliers.front().time_s, middle_s);
  EXPECT_EQ(likelihood.innovations.size(), run.epochs.size() - 3);
}

}  // namespace
}  // namespace trundle::calibration
