#include "trundle/calibration/calibrate.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "calibration/simulated_runs.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using test::nominal_differential;
using test::recorded;
using test::scenario_of;
using test::true_differential;
using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::HasSubstr;

const ParameterEstimate& parameter(const CalibrationResult& result, const std::string& name) {
  for (const ParameterEstimate& e : result.parameters)
    if (e.name == name) return e;
  throw std::out_of_range(name);
}

/// A run of which only the end was measured.
Recording with_partial_reference(const Robot& nominal, const Robot& truth, const Path& path,
                                 std::uint64_t seed, const PartialReferenceOptions& partial) {
  Scenario scenario = scenario_of(nominal, truth, path, seed);
  scenario.reference.rate_hz = 0.0;
  scenario.partial = partial;
  Recording recording = simulate(scenario).recording;
  recording.name = "run " + std::to_string(seed);
  recording.session = "one";
  return recording;
}

TEST(Calibrate, FindsTheTrueRobotAndSaysHowSure) {
  const auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 1);
  const CalibrationResult result = calibrate(runs, {}, nominal_differential());
  EXPECT_EQ(result.status, CalibrationStatus::all_estimated);
  for (const ParameterEstimate& e : result.parameters) {
    EXPECT_NEAR(e.value, value_of(e.parameter, true_differential()), 4.0 * e.sigma_within) << e.name;
    EXPECT_LT(e.sigma_within, 0.01 * std::abs(e.value)) << e.name;
    EXPECT_FALSE(e.sigma_between.has_value()) << "one session cannot show a spread";
  }
  EXPECT_THAT(result.warnings,
              Contains(HasSubstr("± covers one session; variation between sessions unknown")));
  ASSERT_EQ(result.calibrated.calibration->errors.size() >= 2, true);
  EXPECT_LT(result.calibrated.calibration->errors[0].after,
            0.3 * result.calibrated.calibration->errors[0].before);
}

/// A column that somebody left empty who filled a stream by hand; it was read beyond its end.
TEST(Calibrate, AColumnOfAnotherLengthIsRefused) {
  const auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 1);
  const auto message_with = [&](auto change) {
    auto changed = runs;
    change(changed.front());
    try {
      (void)calibrate(changed, {}, nominal_differential());
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(message_with([](Recording& run) { run.reference.heading_rad.clear(); }),
              HasSubstr("reference: column 'heading_rad' has 0 rows"));
  EXPECT_THAT(message_with([](Recording& run) { run.reference.x_m.pop_back(); }),
              HasSubstr("what was not measured is NaN"));
  EXPECT_THAT(message_with([](Recording& run) { run.wheels.series[1].value.pop_back(); }),
              HasSubstr("wheels: column"));
}

/// Its best track is none: a step that puts both wheels in one place is shortened, and does not end the
/// program.
TEST(Calibrate, OneColumnForTwoWheelsIsSurvived) {
  auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 1);
  for (Recording& run : runs) run.wheels.series[1].value = run.wheels.series[0].value;
  try {
    const CalibrationResult result = calibrate(runs, {}, nominal_differential());
    for (const ParameterEstimate& e : result.parameters) EXPECT_TRUE(std::isfinite(e.value)) << e.name;
  } catch (const CannotAnswer& reason) {
    EXPECT_STRNE(reason.what(), "");
  }
}

TEST(Calibrate, AReferenceOfAnotherPointIsNamedWhereItIsSeen) {
  const auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 1);
  const auto names_it = Contains(HasSubstr("the references fit better with their sensor"));
  EXPECT_THAT(calibrate(runs, {}, nominal_differential()).warnings, testing::Not(names_it));
  Robot elsewhere = nominal_differential();
  elsewhere.body_from_reference.x = -0.2;
  EXPECT_THAT(calibrate(runs, {}, elsewhere).warnings, names_it);
}

TEST(Calibrate, WhereTheReferenceIsOnAnOmniRobotIsNotObservable) {
  const auto runs = recorded(test::nominal_omni3(), test::true_omni3(), test::omni_paths(), 1);
  EXPECT_THAT(calibrate(runs, {}, test::nominal_omni3()).unobservable,
              Contains(HasSubstr("reference.x, reference.y, reference.heading")));
}

TEST(Calibrate, HoldOutRunsAreEvaluatedButNotLearnedFrom) {
  const auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 2);
  const auto tour =
      recorded(nominal_differential(), true_differential(), {circle(1.0, 1.0, TurnSense::ccw)}, 3);
  const CalibrationResult alone = calibrate(runs, {}, nominal_differential());
  const CalibrationResult with = calibrate(runs, tour, nominal_differential());
  EXPECT_EQ(parameter(alone, "track").value, parameter(with, "track").value);
  ASSERT_TRUE(with.runs.back().hold_out);
  EXPECT_LT(with.runs.back().after->position_rms_m, 0.2 * with.runs.back().before->position_rms_m);
  const auto of_errors = Contains(HasSubstr("no error of the runs that were held out"));
  EXPECT_THAT(with.notes, Not(of_errors));
  std::vector<Recording> without_headings = tour;
  std::ranges::fill(without_headings.front().reference.heading_rad, recording::kNotMeasured);
  EXPECT_THAT(calibrate(runs, without_headings, nominal_differential()).notes, of_errors);
}

TEST(Calibrate, ClosedSquaresCannotShowTheMeanDiameter) {
  std::vector<Recording> runs;
  for (std::uint64_t i = 0; i < 8; ++i)
    runs.push_back(with_partial_reference(nominal_differential(), true_differential(),
                                          square(1.0, i % 2 == 0 ? TurnSense::cw : TurnSense::ccw), 10 + i,
                                          {.turns = true, .heading_sigma_rad = 0.002}));
  const CalibrationResult result =
      calibrate(runs, {}, nominal_differential(), {.free = {"left.diameter", "right.diameter"}});
  EXPECT_EQ(result.status, CalibrationStatus::some_held);
  EXPECT_THAT(result.unobservable, Contains(HasSubstr("straight run of known length")));
  const double mean =
      0.5 * (parameter(result, "left.diameter").value + parameter(result, "right.diameter").value);
  EXPECT_NEAR(mean, 0.15, 1e-9) << "held at nominal";
}

TEST(Calibrate, EndPosesAloneAreEnoughForADifferentialDrive) {
  std::vector<Recording> runs;
  std::uint64_t seed = 20;
  for (const Path& path : test::differential_paths())
    for (int repeat = 0; repeat < 3; ++repeat)
      runs.push_back(with_partial_reference(nominal_differential(), true_differential(), path, seed++,
                                            {.end_pose = true}));
  const CalibrationResult result = calibrate(runs, {}, nominal_differential());
  EXPECT_EQ(result.status, CalibrationStatus::all_estimated);
  for (const ParameterEstimate& e : result.parameters)
    EXPECT_NEAR(e.value, value_of(e.parameter, true_differential()), 4.0 * e.sigma_within) << e.name;
}

TEST(Calibrate, NothingMeasuredIsNothingEstimated) {
  auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 4);
  for (Recording& run : runs) run.reference = {};
  EXPECT_THROW(calibrate(runs, {}, nominal_differential()), CannotAnswer);
  for (Recording& run : runs)  // of another day
    run.relative_motions = {{.start_s = 1e6, .end_s = 1e6 + 1.0, .motion = {0.1, 0.0, 0.2}}};
  EXPECT_THROW(calibrate(runs, {}, nominal_differential()), CannotAnswer);
}

TEST(Calibrate, AStraightRunAloneHoldsTheTrack) {
  Recording run = with_partial_reference(nominal_differential(), true_differential(), straight(4.0), 5,
                                         {.distance = true});
  const CalibrationResult result = calibrate(std::vector{run}, {}, nominal_differential());
  EXPECT_EQ(parameter(result, "track").value, parameter(result, "track").nominal);
  EXPECT_FALSE(parameter(result, "track").observable);
  EXPECT_THAT(result.unobservable, Contains(HasSubstr("turn on the spot")));
}

TEST(Calibrate, AnOutlyingRunIsDownWeightedAndNamed) {
  std::vector<Path> paths;
  for (int i = 0; i < 2; ++i)
    for (const Path& path : test::differential_paths()) paths.push_back(path);
  auto runs = recorded(nominal_differential(), true_differential(), paths, 6);
  // A wheel of one run slipped by 10 %.
  for (WheelSeries& series : runs[4].wheels.series)
    if (series.wheel == "left")
      for (double& ticks : series.value) ticks *= 1.1;
  const CalibrationResult result = calibrate(runs, {}, nominal_differential());
  EXPECT_LT(result.runs[4].weight, 0.5);
  EXPECT_THAT(result.runs[4].remark, AnyOf(HasSubstr("outlying run"), HasSubstr("reference left out")));
  EXPECT_THAT(result.warnings, Contains(HasSubstr("run 5")));
}

TEST(Calibrate, AJumpOfTheReferenceIsNamedAndDoesNoHarm) {
  auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 7);
  ReferenceStream& reference = runs[3].reference;
  for (std::size_t i = reference.time_s.size() / 2; i < reference.time_s.size(); ++i) reference.x_m[i] += 0.5;
  const CalibrationResult result = calibrate(runs, {}, nominal_differential());
  EXPECT_THAT(result.runs[3].remark, HasSubstr("jumps"));
  for (const ParameterEstimate& e : result.parameters)
    EXPECT_NEAR(e.value, value_of(e.parameter, true_differential()), 0.004 * std::abs(e.value)) << e.name;
}

TEST(Calibrate, AFirstRowThatIsGarbageDoesNoHarm) {
  for (const Robot& robot : {nominal_differential(), test::nominal_omni3()}) {
    const bool rolls = robot.chassis.wheel_count == 2;
    auto runs = rolls ? recorded(robot, true_differential(), test::differential_paths(), 1)
                      : recorded(robot, test::true_omni3(), test::omni_paths(), 1);
    const CalibrationResult clean = calibrate(runs, {}, robot);
    for (Recording& run : runs)
      run.reference.x_m.front() = run.reference.y_m.front() = run.reference.heading_rad.front() = 100.0;
    for (const ParameterEstimate& e : calibrate(runs, {}, robot).parameters)
      EXPECT_NEAR(e.value, parameter(clean, e.name).value, 2.0 * e.sigma_within) << e.name;
  }
}

TEST(Calibrate, AReferenceOnceASecondIsEnough) {
  std::vector<Recording> runs;
  for (const Path& path : test::differential_paths()) {
    Scenario scenario = scenario_of(nominal_differential(), true_differential(), path, 40 + runs.size());
    scenario.encoders.rate_hz = 20.0;
    scenario.reference.rate_hz = 1.0;
    runs.push_back(simulate(scenario).recording);
    runs.back().name = "run " + std::to_string(runs.size());
  }
  const CalibrationResult result = calibrate(runs, {}, nominal_differential());
  EXPECT_EQ(result.status, CalibrationStatus::all_estimated);
  for (const ParameterEstimate& e : result.parameters) {
    EXPECT_NEAR(e.value, value_of(e.parameter, true_differential()), 4.0 * e.sigma_within) << e.name;
    EXPECT_LT(e.sigma_within, 0.01 * std::abs(e.value)) << e.name;
  }
}

TEST(Calibrate, WhatChangedSinceTheCalibrationInTheRobotFileIsNamed) {
  const auto is_named = Contains(HasSubstr("σ off the calibration in the robot file"));
  const auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 1);
  const Robot before = calibrate(runs, {}, nominal_differential()).calibrated;
  const auto again = recorded(nominal_differential(), true_differential(), test::differential_paths(), 2);
  EXPECT_THAT(calibrate(again, {}, before).warnings, testing::Not(is_named));
  Robot taped = true_differential();
  set_value({ParameterKind::track, -1}, 0.425, taped);  // both wheels slip in every turn
  const auto slipping = recorded(nominal_differential(), taped, test::differential_paths(), 3);
  EXPECT_THAT(calibrate(slipping, {}, before).warnings, is_named);
}

TEST(Calibrate, FindsWhereTheReferenceSensorSits) {
  Robot truth = true_differential();
  truth.body_from_reference = {0.12, -0.05, 0.3};
  const auto runs = recorded(nominal_differential(), truth, test::differential_paths(), 8);
  const CalibrationResult result = calibrate(runs, {}, nominal_differential(),
                                             {.free = {"reference.x", "reference.y", "reference.heading"}});
  EXPECT_NEAR(parameter(result, "reference.x").value, 0.12, 0.01);
  EXPECT_NEAR(parameter(result, "reference.y").value, -0.05, 0.01);
  EXPECT_NEAR(parameter(result, "reference.heading").value, 0.3, 0.02);
  EXPECT_NEAR(parameter(result, "track").value, 0.413, 0.004);
}

TEST(Calibrate, FindsATimeOffsetOfTheReferenceWhenAsked) {
  for (const std::uint64_t seed : {9, 10, 11, 12, 13, 14, 15, 16}) {
    auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), seed);
    for (Recording& run : runs)
      for (double& t : run.reference.time_s) t -= 0.15;
    const CalibrationResult result =
        calibrate(runs, {}, nominal_differential(), {.free = {"reference.time_offset"}});
    EXPECT_NEAR(parameter(result, "reference.time_offset").value, 0.15, 0.02) << seed;
  }
}

TEST(Calibrate, SetsTheClockOfEachReferenceByItsRun) {
  auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 10);
  const CalibrationResult before = calibrate(runs, {}, nominal_differential());
  const double late_s[] = {0.9, -0.8};  // rows are 0.25 s apart
  for (std::size_t i = 0; i < 2; ++i)
    for (double& t : runs[i].reference.time_s) t -= late_s[i];
  const CalibrationResult result = calibrate(runs, {}, nominal_differential());
  for (std::size_t i = 0; i < 2; ++i) {
    ASSERT_TRUE(result.runs[i].reference_clock) << i;
    EXPECT_NEAR(result.runs[i].reference_clock->offset_s, late_s[i],
                4.0 * result.runs[i].reference_clock->sigma_s);
  }
  EXPECT_FALSE(before.runs[0].reference_clock);
  ASSERT_TRUE(result.reference_clocks);
  EXPECT_THAT(result.notes, Contains(HasSubstr("2 runs of 4")));
  for (const ParameterEstimate& e : result.parameters)
    EXPECT_NEAR(e.value, parameter(before, e.name).value, 3.0 * e.sigma_total) << e.name;
}

TEST(Calibrate, SetsTheClockOfTheGyroByTheLogs) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Robot nominal = nominal_differential();
  nominal.chassis.gyro = Gyro{};
  Robot truth = true_differential();
  truth.chassis.gyro = Gyro{.time_offset_s = -0.05};
  std::vector<Recording> runs;
  std::uint64_t seed = 60;
  for (const Path& path : test::differential_paths()) {
    Scenario scenario = scenario_of(nominal, truth, path, seed++);
    scenario.encoders.rate_hz = 20.0;
    runs.push_back(simulate(scenario).recording);
    runs.back().session = "one";
  }
  const CalibrationResult result = calibrate(runs, {}, nominal);
  EXPECT_NEAR(result.calibrated.chassis.gyro->time_offset_s, -0.05, 0.002);
  EXPECT_THAT(result.notes, Contains(HasSubstr("gyro.time_offset_s -0.0")));
  EXPECT_EQ(result.nominal.chassis.gyro->time_offset_s, 0.0);
}

TEST(Calibrate, SessionsThatDifferWidenTheIntervals) {
  std::vector<Recording> runs;
  for (int session = 0; session < 4; ++session) {
    Robot truth = true_differential();
    set_value({ParameterKind::track, -1}, 0.413 + 0.003 * (session - 1.5), truth);
    for (Recording& run : recorded(nominal_differential(), truth, test::differential_paths(),
                                   30 + static_cast<std::uint64_t>(session))) {
      run.session = "session " + std::to_string(session);
      runs.push_back(std::move(run));
    }
  }
  const CalibrationResult result = calibrate(runs, {}, nominal_differential());
  EXPECT_EQ(result.sessions, 4);
  ASSERT_TRUE(parameter(result, "track").sigma_between.has_value());
  // The four tracks given have a standard deviation of 3.9 mm.
  EXPECT_NEAR(*parameter(result, "track").sigma_between, 0.0039, 0.0015);
  EXPECT_GT(*parameter(result, "track").sigma_between, 2.0 * parameter(result, "track").sigma_within);
  // What is printed and what odometry carries along is one number: within, between, and the mean of four;
  // with three degrees of freedom Student's t is within 1.19688 in 68.27 %.
  const double further = 1.1968814 * std::sqrt(1.25);
  Eigen::Index index = 0;
  for (const ParameterEstimate& e : result.parameters) {
    if (!e.observable) continue;
    EXPECT_NEAR(e.sigma_total, std::hypot(e.sigma_within, *e.sigma_between * further), 1e-6 * e.sigma_total)
        << e.name;
    EXPECT_DOUBLE_EQ(e.sigma_total, std::sqrt(result.covariance_total(index, index))) << e.name;
    ++index;
  }
}

TEST(Calibrate, AnUnknownParameterIsNamedWithTheNearestKnownOne) {
  const auto runs = recorded(nominal_differential(), true_differential(), test::differential_paths(), 11);
  try {
    calibrate(runs, {}, nominal_differential(), {.free = {"left.diametre"}});
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("left.diameter"));
  }
}

TEST(Calibrate, FindsTheScaleOfAGyroWhicheverWayItIsMounted) {
  for (const double sign : {1.0, -1.0}) {
    Robot nominal = nominal_differential();
    nominal.chassis.gyro = Gyro{.scale = sign};
    Robot truth = true_differential();
    truth.chassis.gyro = Gyro{.bias_rad_s = 0.01, .scale = 1.03 * sign};
    const CalibrationResult result =
        calibrate(recorded(nominal, truth, test::differential_paths(), 13), {}, nominal);
    const ParameterEstimate& scale = parameter(result, "gyro.scale");
    EXPECT_NEAR(scale.value, 1.03 * sign, 4.0 * scale.sigma_within);
    EXPECT_LT(scale.sigma_within, 0.005);
  }
}

TEST(Calibrate, PositionsAloneTellThatAGyroIsUpsideDown) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Robot nominal = nominal_differential();
  nominal.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 1e-3};
  Robot truth = true_differential();
  truth.chassis.gyro = Gyro{.scale = -1.01, .noise_rad_s_sqrt_hz = 1e-3};
  std::vector<Recording> runs;
  for (std::uint64_t seed = 70; seed < 74; ++seed) {
    Random random(seed, 5);
    Scenario scenario = scenario_of(nominal, truth, random_tour({.length_m = 15.0}, {}, random), seed);
    runs.push_back(simulate(scenario).recording);
    runs.back().name = "run " + std::to_string(seed);
    for (double& heading : runs.back().reference.heading_rad) heading = kNotMeasured;
  }
  const CalibrationResult result = calibrate(runs, {}, nominal);
  EXPECT_THAT(result.warnings, Contains(HasSubstr("the gyro is mounted upside down")));
  EXPECT_NEAR(parameter(result, "gyro.scale").value, -1.01,
              4.0 * parameter(result, "gyro.scale").sigma_within);
  // Wheels that are swapped turn it the other way as well, and that no gyro is to be turned for.
  for (Recording& run : runs) std::swap(run.wheels.series[0].value, run.wheels.series[1].value);
  for (Recording& run : runs)
    for (double& rate : run.gyro.yaw_rate_rad_s) rate = -rate;
  EXPECT_THROW((void)calibrate(runs, {}, nominal), CannotAnswer);
}

TEST(Calibrate, SkidSteerFindsItsEffectiveTrackFromTheGyroAlone) {
  Robot nominal = test::robot_of(skid_steer({0.25, 2000.0, 0}, 0.40, 0.3), {"fl", "fr", "rl", "rr"});
  nominal.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 1e-3};
  Robot truth = nominal;
  set_value({ParameterKind::track, -1}, 0.62, truth);
  auto runs =
      recorded(nominal, truth,
               {joined({pause(3.0), circle(1.0, 2.0, TurnSense::ccw), circle(1.0, 2.0, TurnSense::cw)})}, 12);
  for (Recording& run : runs) run.reference = {};
  const CalibrationResult result = calibrate(runs, {}, nominal);
  EXPECT_NEAR(parameter(result, "track").value, 0.62, 4.0 * parameter(result, "track").sigma_within);
  EXPECT_LT(parameter(result, "track").sigma_within, 0.02);
  EXPECT_THAT(result.unobservable,
              testing::Contains(testing::StartsWith("fl.diameter, fr.diameter, rl.diameter, rr.diameter, "
                                                    "gyro.scale: no length was measured from outside")));
}

TEST(Calibrate, RunsThatTellNothingChangeNothingAndAreNamed) {
  const Robot nominal = test::nominal_differential();
  std::vector<Recording> runs =
      test::recorded(nominal, test::true_differential(), {square(1.5, TurnSense::cw)}, 3);
  const CalibrationResult expected = calibrate(runs, {}, nominal);
  Recording blind = runs.front();
  blind.name = "blind";
  blind.session = "another";
  blind.reference = {};
  runs.insert(runs.begin(), blind);
  const CalibrationResult found = calibrate(runs, {}, nominal);
  for (std::size_t j = 0; j < expected.parameters.size(); ++j) {
    EXPECT_EQ(found.parameters[j].value, expected.parameters[j].value);
    EXPECT_EQ(found.parameters[j].sigma_within, expected.parameters[j].sigma_within);
  }
  EXPECT_EQ(found.sessions, 1);
  EXPECT_EQ(found.runs.size(), 1U);
  EXPECT_THAT(found.warnings, testing::Contains(testing::HasSubstr("run blind shows nothing")));
}

}  // namespace
}  // namespace trundle::calibration
