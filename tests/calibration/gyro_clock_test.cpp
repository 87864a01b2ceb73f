// The gyro's time offset as a parameter of the estimator.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/solve/estimator.hpp"

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

constexpr Parameter kClock{ParameterKind::gyro_time_offset, -1};

Robot robot_with_clock(double time_offset_s) {
  Robot robot = test::nominal_differential();
  robot.chassis.gyro =
      Gyro{.noise_rad_s_sqrt_hz = 0.001, .bias_walk_rad_s_sqrt_s = 0.0, .time_offset_s = time_offset_s};
  return robot;
}

Recording run_of(const Path& path, double time_offset_s, std::uint64_t seed) {
  Scenario scenario =
      test::scenario_of(robot_with_clock(time_offset_s), robot_with_clock(time_offset_s), path, seed);
  scenario.encoders.rate_hz = 10.0;
  scenario.reference.rate_hz = 10.0;
  scenario.whole_intervals = false;
  return simulate(scenario).recording;
}

std::vector<Recording> tours(double time_offset_s, std::uint64_t seed) {
  std::vector<Recording> recordings;
  for (std::uint64_t i = 0; i < 3; ++i) {
    Random random(seed * 10 + i, 5);
    recordings.push_back(run_of(random_tour({.length_m = 10.0}, {}, random), time_offset_s, seed * 10 + i));
    recordings.back().name = "run " + std::to_string(i);
    recordings.back().session = "one";
  }
  return recordings;
}

std::vector<Run> prepared_tours(double time_offset_s, std::uint64_t seed, const Robot& robot) {
  std::vector<Run> runs;
  for (const Recording& recording : tours(time_offset_s, seed)) runs.push_back(prepare_run(recording, robot));
  return runs;
}

TEST(GyroClock, its_interval_holds_the_truth_as_often_as_it_says) {
  const int trials = test::trials(10, 1);
  int inside = 0;
  double squares = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const double truth = 0.03 - 0.002 * (trial % 7);
    const Robot given = robot_with_clock(0.02);
    auto runs = prepared_tours(truth, 100 + static_cast<std::uint64_t>(trial), given);
    const std::vector<Parameter> parameters = {{ParameterKind::diameter, 0},
                                               {ParameterKind::diameter, 1},
                                               {ParameterKind::track, -1},
                                               {ParameterKind::gyro_scale, -1},
                                               kGyroBias,
                                               kClock};
    const Estimate estimate = estimate_parameters({runs, given, parameters});
    const double sigma = std::sqrt(estimate.covariance(5, 5));
    const double error = estimate.robot.chassis.gyro->time_offset_s - truth;
    EXPECT_LT(sigma, 0.004);
    inside += std::abs(error) <= 1.96 * sigma ? 1 : 0;
    squares += error * error / (sigma * sigma);
  }
  std::printf("gyro.time_offset: %d of %d inside 95 %%, mean square %.2f\n", inside, trials,
              squares / trials);
  EXPECT_GE(inside, 0.95 * trials - 4.0 * std::sqrt(0.95 * 0.05 * trials));
  EXPECT_GT(squares / trials, 1.0 - 4.0 * std::sqrt(2.0 / trials));
}

TEST(GyroClock, is_reported_and_written_into_the_robot_file) {
  const CalibrationResult result =
      calibrate(tours(0.033, 7), tours(0.033, 8), robot_with_clock(0.0), {.free = {"gyro.time_offset"}});
  const auto found = std::ranges::find(result.parameters, kClock, &ParameterEstimate::parameter);
  ASSERT_NE(found, result.parameters.end());
  EXPECT_TRUE(found->observable);
  EXPECT_EQ(found->unit, "s");
  EXPECT_EQ(found->nominal, 0.0);
  EXPECT_NEAR(found->value, 0.033, 4.0 * found->sigma_within);
  EXPECT_EQ(result.calibrated.chassis.gyro->time_offset_s, found->value);
  EXPECT_EQ(parse_robot(to_toml(result.calibrated), "r").chassis.gyro->time_offset_s, found->value);
}

TEST(GyroClock, that_it_cannot_be_told_is_said) {
  std::vector<Recording> recordings;
  for (std::uint64_t i = 0; i < 3; ++i) recordings.push_back(run_of(straight(6.0), 0.03, 60 + i));
  const CalibrationResult result =
      calibrate(recordings, {}, robot_with_clock(0.03), {.free = {"gyro.time_offset"}});
  EXPECT_THAT(result.unobservable, testing::Contains(testing::HasSubstr("gyro.time_offset")));
  EXPECT_EQ(result.calibrated.chassis.gyro->time_offset_s, 0.03);
}

}  // namespace
}  // namespace trundle::calibration
