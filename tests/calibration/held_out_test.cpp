#include "trundle/calibration/validation/held_out.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test;

const ReferenceNoise kReference{.position_m = kPositionSigma_m, .heading_rad = kHeadingSigma_rad};

struct HeldOutDrive {
  const char* name;
  Robot given, truth;
  Path path;
  double encoders_hz, reference_hz;
};

void PrintTo(const HeldOutDrive& driven, std::ostream* stream) {
  *stream << driven.name;
}

std::vector<HeldOutDrive> held_out_drives() {
  const Path squares = trundle::simulation::joined({square(1.5, TurnSense::ccw), square(1.5, TurnSense::cw)});
  const Path away = trundle::simulation::joined({circle(0.6, 1.5, TurnSense::cw), straight(4.0)});
  return {{"squares", nominal_differential(), true_differential(), squares, 4.0, 4.0},
          {"circle and away, seldom seen", nominal_differential(), true_differential(), away, 50.0, 0.7},
          {"omni", nominal_omni3(), true_omni3(), l_run(1.5), 20.0, 5.0}};
}

class HeldOutPull : public testing::TestWithParam<HeldOutDrive> {};

TEST_P(HeldOutPull, OfARobotWithoutFaultThePullIsWhatChanceMakes) {
  const int draws = test::trials(800, 40);
  const HeldOutDrive& driven = GetParam();
  double sum = 0.0, of_squares = 0.0;
  for (int seed = 1; seed <= draws; ++seed) {
    Scenario scenario = scenario_of(driven.given, driven.truth, driven.path, seed);
    scenario.encoders.rate_hz = driven.encoders_hz;
    scenario.reference.rate_hz = driven.reference_hz;
    const calibration::Run run = prepare_run(simulate(scenario).recording, driven.given);
    const auto errors = held_out_errors(run, driven.given, driven.truth, kReference, false);
    ASSERT_TRUE(errors);
    const double pull = errors->pull_m2 / std::sqrt(errors->pull_variance_m4);
    sum += pull;
    of_squares += pull * pull;
  }
  // Of so many standard normals: 4 sigmas of the mean, and of the mean square.
  EXPECT_NEAR(sum / draws, 0.0, 4.0 / std::sqrt(draws));
  EXPECT_NEAR(of_squares / draws, 1.0, 4.0 * std::sqrt(2.0 / draws));
}

INSTANTIATE_TEST_SUITE_P(Drives, HeldOutPull, testing::ValuesIn(held_out_drives()));

TEST(HeldOutErrors, TheErrorsAreThoseOfOdometryLaidOnTheReference) {
  const calibration::Run run =
      prepared(nominal_differential(), true_differential(), {square(1.5, TurnSense::ccw)}, 1).front();
  const auto errors = held_out_errors(run, nominal_differential(), true_differential(), kReference, false);
  const auto same = held_out_errors(run, true_differential(), true_differential(), kReference, false);
  ASSERT_TRUE(errors && same);
  EXPECT_GT(errors->given_m2, 10.0 * errors->calibrated_m2);
  EXPECT_EQ(same->given_m2, errors->calibrated_m2);
  EXPECT_EQ(same->pull_m2, 0.0);
  EXPECT_EQ(same->pull_variance_m4, 0.0);
}

TEST(HeldOutErrors, AStepBackToTheRightRobotPullsByMoreThanChance) {
  const calibration::Run run =
      prepared(true_differential(), true_differential(), {square(1.5, TurnSense::ccw)}, 1).front();
  const auto errors = held_out_errors(run, true_differential(), nominal_differential(), kReference, false);
  ASSERT_TRUE(errors);
  EXPECT_LT(errors->given_m2, errors->calibrated_m2);
  EXPECT_GT(errors->pull_m2, 5.0 * std::sqrt(errors->pull_variance_m4));
}

}  // namespace
}  // namespace trundle::calibration
