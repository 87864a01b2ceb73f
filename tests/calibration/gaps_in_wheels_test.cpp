// Rows of wheels that are missing: the travel of a gap is known, its course is not.
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"

#include "calibration/simulated_runs.hpp"

namespace trundle::calibration {
namespace {

using test::nominal_differential;
using test::true_differential;

constexpr double kGapRate_hz = 10.0;
const Pace kNonStop{.forward_m_s = 0.5, .turn_rad_s = 1.5, .rest_s = 0.0};

/// Its wheels are so good that what a gap hides is most of what the end is off by.
Robot with_good_wheels(Robot robot) {
  robot.chassis.noise.wheel_per_sqrt_m = 0.0005;
  return robot;
}

void lose_wheel_rows(const TimeSpan& gap, Recording& recording) {
  const std::vector<double> time_s = recording.wheels.time_s;
  const auto lose = [&](std::vector<double>& values) {
    std::size_t i = 0;
    std::erase_if(values, [&](double) {
      const double t = time_s[i++];
      return t > gap.start_s + 1e-9 && t < gap.end_s() - 1e-9;
    });
  };
  for (WheelSeries& series : recording.wheels.series) lose(series.value);
  lose(recording.wheels.time_s);
}

/// Of each of them the end pose alone was measured.
std::vector<Recording> squares_by_end_pose(double side_m) {
  std::vector<Recording> recordings;
  for (std::uint64_t i = 0; i < 8; ++i) {
    const Path path = square(side_m, i % 2 == 0 ? TurnSense::cw : TurnSense::ccw, kNonStop);
    Scenario scenario = test::scenario_of(with_good_wheels(nominal_differential()),
                                          with_good_wheels(true_differential()), path, 10 + i);
    scenario.encoders.rate_hz = kGapRate_hz;
    scenario.reference.rate_hz = 0.0;
    scenario.partial.end_pose = true;
    recordings.push_back(simulate(scenario).recording);
    recordings.back().name = "run " + std::to_string(i + 1);
    recordings.back().session = "one";
  }
  return recordings;
}

/// Squares do not show the mean diameter, which is held; they show all ratios.
TEST(GapsInWheels, OneWithinATurnOfASquareLeavesTheEstimateAsItIs) {
  constexpr double kSide_m = 1.5;
  constexpr double kGap_s = 2.0;
  const double leg_s = kSide_m / kNonStop.forward_m_s, turn_s = 0.5 * kPi / kNonStop.turn_rad_s;
  const std::vector<Recording> whole = squares_by_end_pose(kSide_m);
  const Robot nominal = with_good_wheels(nominal_differential());
  const CalibrationResult without = calibrate(whole, {}, nominal);
  for (const double share : {0.0, 0.3, 0.6, 1.0}) {  // of the second turn, about which the gap lies
    std::vector<Recording> recordings = whole;
    const double middle_s = 2.0 * leg_s + (1.0 + share) * turn_s;
    lose_wheel_rows({middle_s - 0.5 * kGap_s, kGap_s}, recordings.front());
    const CalibrationResult result = calibrate(recordings, {}, nominal);
    ASSERT_EQ(result.parameters.size(), without.parameters.size());
    for (std::size_t i = 0; i < result.parameters.size(); ++i) {
      const ParameterEstimate &e = result.parameters[i], &as_whole = without.parameters[i];
      const double truth = value_of(e.parameter, true_differential());
      std::printf("gap at %.1f of a turn: %-14s %.5f, whole %.5f, truth %.5f, sigma %.5f\n", share,
                  e.name.c_str(), e.value, as_whole.value, truth, e.sigma_total);
      EXPECT_NEAR(e.value, truth, 4.0 * e.sigma_total) << e.name << " " << share;
      EXPECT_NEAR(e.value, truth, 0.01 * truth) << e.name << " " << share;
      EXPECT_NEAR(e.value, as_whole.value, 2.0 * as_whole.sigma_within) << e.name << " " << share;
      EXPECT_LT(e.sigma_within, 1.5 * as_whole.sigma_within) << e.name << " " << share;
    }
  }
}

TEST(GapsInWheels, OneEveryFewSecondsOfATourCostsLittle) {
  std::vector<Recording> whole, with_gaps;
  for (std::uint64_t i = 0; i < 2; ++i) {
    Random random(40 + i, 1);
    const Path path = random_tour({.length_m = 40.0, .pause_share = 0.0}, {}, random, kNonStop);
    Scenario scenario = test::scenario_of(with_good_wheels(nominal_differential()),
                                          with_good_wheels(true_differential()), path, 40 + i);
    scenario.encoders.rate_hz = 2.0 * kGapRate_hz;
    scenario.reference.rate_hz = 2.0 * kGapRate_hz;
    whole.push_back(simulate(scenario).recording);
    whole.back().name = "run " + std::to_string(i + 1);
    whole.back().session = "one";
    with_gaps.push_back(whole.back());
    for (double start_s = 2.0; start_s < duration_of(path); start_s += 5.0)
      lose_wheel_rows({start_s, 0.9}, with_gaps.back());
  }
  const Robot nominal = with_good_wheels(nominal_differential());
  const CalibrationResult without = calibrate(whole, {}, nominal);
  const CalibrationResult result = calibrate(with_gaps, {}, nominal);
  ASSERT_EQ(result.parameters.size(), without.parameters.size());
  for (std::size_t i = 0; i < result.parameters.size(); ++i) {
    const ParameterEstimate &e = result.parameters[i], &as_whole = without.parameters[i];
    const double error = e.value - value_of(e.parameter, true_differential());
    std::printf("%-14s off by %.2f sigmas, sigma %.2e, without gaps %.2f, %.2e\n", e.name.c_str(),
                error / e.sigma_within, e.sigma_within,
                (as_whole.value - value_of(e.parameter, true_differential())) / as_whole.sigma_within,
                as_whole.sigma_within);
    EXPECT_LT(std::abs(error), 4.0 * e.sigma_within) << e.name;
    EXPECT_LT(e.sigma_within, 3.0 * as_whole.sigma_within) << e.name;
  }
}

}  // namespace
}  // namespace trundle::calibration
