#include "trundle/calibration/preparation/channel_assignment.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/io/error.hpp"

#include "calibration/simulated_runs.hpp"
#include "recording/findings.hpp"

namespace trundle::calibration {
namespace {

using test::says;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

Robot nominal_pods() {
  const std::array<Pod, 2> pods{{{0.0, 0.12, 0.0}, {-0.10, 0.0, 0.5 * kPi}}};
  Robot robot = test::robot_of(dead_wheels({0.05, 2048.0, 0}, pods, Gyro{.bias_walk_rad_s_sqrt_s = 0.0}),
                               {"ahead", "across"});
  return robot;
}

/// As it is: other scales, angles and levers; the gyro's scale 2 % off.
Robot true_pods() {
  Robot robot = nominal_pods();
  set_value({ParameterKind::diameter, 0}, 0.0507, robot);
  set_value({ParameterKind::diameter, 1}, 0.0494, robot);
  set_value({ParameterKind::direction, 0}, 0.02, robot);
  set_value({ParameterKind::direction, 1}, 0.5 * kPi - 0.1, robot);
  set_value({ParameterKind::lever, 0}, -0.126, robot);
  set_value({ParameterKind::lever, 1}, -0.094, robot);
  robot.chassis.gyro->scale = 1.02;
  return robot;
}

std::vector<Path> rich_paths() {
  return {joined({l_run(1.5), turn_on_the_spot(kPi), l_run(1.5)}),
          joined({l_run(1.5, TurnSense::cw), turn_on_the_spot(-kPi), circle(0.6, 1.5, TurnSense::cw)}),
          circle(0.6, 1.5, TurnSense::ccw), square(1.5, TurnSense::cw)};
}

std::vector<Recording> rich_runs(std::uint64_t seed) {
  return test::recorded(nominal_pods(), true_pods(), rich_paths(), seed);
}

std::vector<double>& counts(Recording& recording, std::size_t wheel) {
  return recording.wheels.series[wheel].value;
}

void expect_true_pods(const CalibrationResult& result, const Robot& truth) {
  for (const ParameterEstimate& e : result.parameters) {
    if (e.parameter.kind == ParameterKind::gyro_bias) continue;
    EXPECT_NEAR(e.value, value_of(e.parameter, truth), 4.0 * e.sigma_within + 1e-9) << e.name;
    EXPECT_TRUE(e.observable) << e.name;
  }
}

TEST(ChannelAssignment, of_a_robot_as_its_file_says_is_left_alone) {
  const ChannelAssignment channels = check_channels(rich_runs(1), nominal_pods());
  EXPECT_THAT(channels.faults, IsEmpty());
  EXPECT_THAT(channels.ambiguous, IsEmpty());
  EXPECT_EQ(to_toml(channels.robot), to_toml(nominal_pods()));
}

TEST(ChannelAssignment, a_rich_run_gives_angles_scales_offsets_and_gyro_scale_of_two_pods) {
  const CalibrationResult result = calibrate(rich_runs(2), {}, nominal_pods());
  EXPECT_EQ(result.status, CalibrationStatus::all_estimated);
  expect_true_pods(result, true_pods());
}

TEST(ChannelAssignment, swapped_ports_are_said_and_calibrated_all_the_same) {
  auto runs = rich_runs(3);
  for (Recording& run : runs) std::swap(counts(run, 0), counts(run, 1));
  const ChannelAssignment channels = check_channels(runs, nominal_pods());
  EXPECT_THAT(channels.faults, ElementsAre(says("look swapped: 'ahead' and 'across' carry")));
  EXPECT_THAT(channels.robot.wheel_names, ElementsAre("across", "ahead"));
  const CalibrationResult result = calibrate(runs, {}, nominal_pods());
  EXPECT_THAT(result.warnings,
              Contains(AllOf(HasSubstr("look swapped"), HasSubstr("swap the two columns in recording.toml"),
                             HasSubstr("already compensated in the calibrated robot"))));
  expect_true_pods(result, true_pods());
}

TEST(ChannelAssignment, a_pod_that_counts_backwards_is_said_and_calibrated_all_the_same) {
  auto runs = rich_runs(4);
  for (Recording& run : runs)
    for (double& count : counts(run, 1)) count = -count;
  const ChannelAssignment channels = check_channels(runs, nominal_pods());
  EXPECT_THAT(channels.faults, ElementsAre(says("'across' counts backwards: ticks_per_revolution = -2048")));
  expect_true_pods(calibrate(runs, {}, nominal_pods()), true_pods());
}

TEST(ChannelAssignment, everything_wrong_at_once) {
  auto runs = rich_runs(5);
  for (Recording& run : runs) {
    std::swap(counts(run, 0), counts(run, 1));
    for (double& count : counts(run, 0)) count = -count;
    for (double& rate : run.gyro.yaw_rate_rad_s) rate = -rate;
  }
  const ChannelAssignment channels = check_channels(runs, nominal_pods());
  EXPECT_THAT(channels.faults, ElementsAre(says("look swapped"), says("'ahead' counts backwards"),
                                           says("gyro is mounted upside down")));
}

TEST(ChannelAssignment, columns_that_are_no_counts_are_turned_by_direction) {
  auto runs = rich_runs(6);
  for (Recording& run : runs)
    for (std::size_t w = 0; w < 2; ++w) {
      run.wheels.series[w].unit = WheelUnit::radians;
      for (double& value : counts(run, w)) value *= (w == 1 ? -1.0 : 1.0) * 2.0 * kPi / 2048.0;
    }
  const ChannelAssignment channels = check_channels(runs, nominal_pods());
  EXPECT_THAT(channels.faults, ElementsAre(says("'across' reads backwards: direction_deg = -90")));
}

TEST(ChannelAssignment, of_a_differential_drive_shows_in_turns) {
  auto runs =
      test::recorded(test::nominal_differential(), test::true_differential(), test::differential_paths(), 7);
  EXPECT_THAT(check_channels(runs, test::nominal_differential()).faults, IsEmpty());
  for (Recording& run : runs) std::swap(counts(run, 0), counts(run, 1));
  EXPECT_THAT(check_channels(runs, test::nominal_differential()).faults,
              ElementsAre(says("look swapped: 'left' and 'right' carry")));
}

/// Turns and straights with a gyro that is upside down.
std::vector<Recording> runs_with_contrary_gyro(const Robot& robot, std::uint64_t seed) {
  auto runs = test::recorded(robot, robot, test::differential_paths(), seed);
  for (Recording& run : runs)
    for (double& rate : run.gyro.yaw_rate_rad_s) rate = -rate;
  return runs;
}

Robot differential_with_gyro() {
  Robot robot = test::nominal_differential();
  robot.chassis.gyro = Gyro{.bias_walk_rad_s_sqrt_s = 0.0};
  return robot;
}

TEST(ChannelAssignment, a_gyro_against_the_wheels_is_not_explained_away_without_a_reference) {
  const Robot robot = differential_with_gyro();
  auto runs = runs_with_contrary_gyro(robot, 10);
  for (Recording& run : runs) run.reference = {};
  try {
    calibrate(runs, {}, robot);
    FAIL() << "one of two explanations was taken";
  } catch (const CannotAnswer& reason) {
    EXPECT_THAT(reason.what(), AllOf(HasSubstr("run run 1: the gyro turns the other way"),
                                     HasSubstr("scale = -1 under [gyro]"),
                                     HasSubstr("swap their columns in recording.toml")));
  }
  Robot upside_down = robot;
  upside_down.chassis.gyro->scale = -1.0;
  const CalibrationResult result = calibrate(runs, {}, upside_down);
  const auto track =
      std::ranges::find(result.parameters, ParameterKind::track,
                        [](const ParameterEstimate& estimate) { return estimate.parameter.kind; });
  ASSERT_NE(track, result.parameters.end());
  EXPECT_NEAR(track->value, value_of(track->parameter, robot), 4.0 * track->sigma_within);
}

/// Positions alone do not show which wheel is reversed; the gyro does.
TEST(ChannelAssignment, a_wheel_that_counts_backwards_by_the_gyro_is_named_and_not_estimated) {
  const Robot robot = differential_with_gyro();
  auto runs = test::recorded(robot, robot, test::differential_paths(), 12);
  for (Recording& run : runs) {
    std::ranges::fill(run.reference.heading_rad, kNotMeasured);
    for (double& count : counts(run, 1)) count = -count;
  }
  try {
    calibrate(runs, {}, robot);
    FAIL() << "a wheel of the wrong sign was estimated";
  } catch (const CannotAnswer& reason) {
    EXPECT_THAT(reason.what(), HasSubstr("'right' counts backwards, as the gyro shows"));
  }
}

TEST(ChannelAssignment, a_gyro_against_wheels_and_reference_is_turned_round_and_said) {
  const Robot robot = differential_with_gyro();
  const CalibrationResult result = calibrate(runs_with_contrary_gyro(robot, 11), {}, robot);
  EXPECT_THAT(result.warnings, Contains(AllOf(HasSubstr("gyro is mounted upside down: scale = -1"),
                                              HasSubstr("already compensated"))));
  EXPECT_NEAR(result.calibrated.chassis.gyro->scale, -1.0, 0.05);
  EXPECT_GT(result.calibrated.chassis.wheels()[0].y_m, 0.0);
}

TEST(ChannelAssignment, what_cannot_be_told_apart_is_said) {
  const auto straight_run =
      test::recorded(test::nominal_differential(), test::true_differential(), {straight(5.0)}, 8);
  EXPECT_THAT(check_channels(straight_run, test::nominal_differential()).ambiguous,
              ElementsAre(says("'left' and 'right' cannot be distinguished by these runs")));
  const CalibrationResult result = calibrate(straight_run, {}, test::nominal_differential());
  EXPECT_THAT(result.unobservable, Contains(HasSubstr("cannot be distinguished")));
  // Two pods one behind the other read alike whatever the robot does.
  const std::array<Pod, 3> pods{{{0.1, 0.0, 0.0}, {-0.1, 0.0, 0.0}, {0.0, 0.1, 0.5 * kPi}}};
  const Robot in_line =
      test::robot_of(dead_wheels({0.05, 2048.0, 0}, pods, Gyro{}), {"front", "rear", "across"});
  EXPECT_THAT(check_channels(test::recorded(in_line, in_line, rich_paths(), 9), in_line).ambiguous,
              ElementsAre(says("'front' and 'rear' cannot be distinguished by any run")));
}

}  // namespace
}  // namespace trundle::calibration
