#include "trundle/slam/smoothing/landmark_calibration.hpp"

#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/solve/own_axes.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/slam/smoothing/smoother.hpp"
#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/gyro_bias_oracle.hpp"
#include "calibration/simulated_runs.hpp"
#include "calibration/velocity_runs.hpp"
#include "held_limits.hpp"
#include "recording/lagging_drive.hpp"
#include "scale.hpp"

namespace trundle::slam {
namespace {

using testing::Contains;
using testing::HasSubstr;

constexpr Parameter kLeft{ParameterKind::diameter, 0};
constexpr Parameter kRight{ParameterKind::diameter, 1};
constexpr Parameter kTrack{ParameterKind::track, -1};

Robot nominal_robot() {
  Robot robot = test::nominal_differential();
  robot.landmark_sensor = LandmarkSensor{{0.1, 0.0, 0.05}, 0.05, radians(1.0), 5.0, 0.0};
  return robot;
}

/// Wheels and track wrong by 1σ of 2 %, 2 % and 5 %.
Robot true_robot(std::uint64_t seed) {
  Robot robot = nominal_robot();
  Random random(seed, 31);
  for (const Parameter& parameter : {kLeft, kRight, kTrack}) {
    const double share = parameter == kTrack ? 0.05 : 0.02;
    set_value(parameter, value_of(parameter, robot) * (1.0 + random.normal(share)), robot);
  }
  return robot;
}

Path tour(double length_m, std::uint64_t seed) {
  Random random(seed, 32);
  return random_tour({.length_m = length_m, .box_x_m = 6.0, .box_y_m = 6.0}, {}, random);
}

/// A robot among twelve landmarks; nothing else is known of where it was.
Scenario scenario_of(const Robot& truth, const Path& path, std::uint64_t seed) {
  Scenario scenario = test::scenario_of(nominal_robot(), truth, path, seed);
  Random random(seed, 33);
  scenario.landmarks = random_landmarks(12, 8.0, 8.0, 1.0, random);
  scenario.encoders.rate_hz = 10.0;
  scenario.reference.rate_hz = 0.0;
  scenario.sightings = {.rate_hz = 2.0, .give_map = false};
  return scenario;
}

Recording recorded(const Scenario& scenario) {
  Recording recording = simulate(scenario).recording;
  recording.name = "tour";
  recording.session = "one";
  return recording;
}

const ParameterEstimate& of(const CalibrationResult& result, const Parameter& parameter) {
  return *std::ranges::find(result.parameters, parameter, &ParameterEstimate::parameter);
}

/// Errors over their sigmas of wheels and track, over many runs.
class Honesty {
 public:
  void add(const CalibrationResult& result, const Robot& truth) {
    for (const Parameter& parameter : {kLeft, kRight, kTrack}) {
      const ParameterEstimate& e = of(result, parameter);
      const double z = (e.value - value_of(parameter, truth)) / e.sigma_within;
      inside_ += std::abs(z) <= 1.96 ? 1 : 0;
      squares_ += z * z;
      ++all_;
    }
  }
  /// With an honest interval 95 % of the runs hold the truth; what is asked for is 90 % of at least so many
  /// that chance does not decide, of fewer what it leaves, and that the intervals are not merely wide: four
  /// times the standard deviation of the mean of so many squares of normal numbers.
  void expect_honest() const {
    EXPECT_GE(inside_, (all_ < 30 ? test::held_limits(all_).first : 0.9) * all_ - 1e-9);
    EXPECT_NEAR(squares_ / all_, 1.0, 4.0 * std::sqrt(2.0 / all_));
  }

 private:
  int inside_ = 0;
  double squares_ = 0.0;
  int all_ = 0;
};

TEST(LandmarkCalibration, RecoversTheTrueRobotWithinItsOwnIntervals) {
  Honesty honesty;
  const int seeds = test::trials(40, 3);
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    const Robot truth = true_robot(s);
    const Recording recording = recorded(scenario_of(truth, tour(40.0, s), s));
    const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, nominal_robot());
    EXPECT_EQ(result.status, CalibrationStatus::all_estimated);
    for (const Parameter& parameter : {kLeft, kRight, kTrack})
      EXPECT_LT(of(result, parameter).sigma_within, 0.01 * of(result, parameter).value);
    honesty.add(result, truth);
  }
  honesty.expect_honest();
}

// Of a sensor that reads 1 % too long all that is found is another one: its sigmas allow for 2 % of that.
TEST(LandmarkCalibration, WhatTheScaleOfRangesMayBeOffByIsInTheSigmas) {
  const Recording recording = recorded(scenario_of(true_robot(1), tour(40.0, 1), 1));
  const CalibrateOptions known{.fix = {"sensor.range_scale"}};
  const auto calibrated_with = [&](double scale, const CalibrateOptions& options) {
    Robot robot = nominal_robot();
    robot.landmark_sensor->range_scale = scale;
    return calibrate_from_landmarks({&recording, 1}, {}, robot, options);
  };
  const CalibrationResult open = calibrated_with(1.0, {}), as_read = calibrated_with(1.0, known),
                          shorter = calibrated_with(0.99, known), longer = calibrated_with(1.01, known);
  const CalibrationRecord& record = *open.calibrated.calibration;
  ASSERT_EQ(record.parameters.back().name, "sensor.range_scale");
  EXPECT_FALSE(record.parameters.back().observable);
  const Eigen::Index scale = record.covariance.rows() - 1;
  EXPECT_NEAR(std::sqrt(record.covariance(scale, scale)), 0.02, 1e-12);
  ASSERT_EQ(std::ssize(open.parameters), scale);
  for (Eigen::Index j = 0; j < scale; ++j) {
    const ParameterEstimate& e = open.parameters[static_cast<std::size_t>(j)];
    const ParameterEstimate& exact = of(as_read, e.parameter);
    EXPECT_EQ(e.value, exact.value) << e.name;
    EXPECT_EQ(e.sigma_within, exact.sigma_within) << e.name;
    EXPECT_EQ(exact.sigma_total, exact.sigma_within) << e.name;
    const double by_scale = (of(longer, e.parameter).value - of(shorter, e.parameter).value) / 0.02;
    EXPECT_NEAR(record.covariance(j, scale), 4e-4 * by_scale, 4e-4 * 0.02 * std::abs(e.value)) << e.name;
    EXPECT_NEAR(e.sigma_total, std::hypot(e.sigma_within, 0.02 * by_scale), 0.03 * e.sigma_total) << e.name;
  }
  EXPECT_EQ(as_read.calibrated.calibration->covariance.rows(), scale);
}

TEST(LandmarkCalibration, FindsScaleAndBiasOfTheGyroToo) {
  Scenario scenario = scenario_of(true_robot(1), tour(40.0, 1), 1);
  scenario.nominal.chassis.gyro = scenario.truth.chassis.gyro = Gyro{};
  scenario.truth.chassis.gyro->scale = 1.02;
  scenario.truth.chassis.gyro->bias_rad_s = 0.01;
  const Recording recording = recorded(scenario);
  const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, scenario.nominal);
  for (const Parameter& parameter : {kLeft, kRight, kTrack, {ParameterKind::gyro_scale, -1}, kGyroBias}) {
    const ParameterEstimate& e = of(result, parameter);
    EXPECT_TRUE(e.observable) << e.name;
    EXPECT_NEAR(e.value, value_of(parameter, scenario.truth), 4.0 * e.sigma_within) << e.name;
  }
}

TEST(LandmarkCalibration, ManagesWithoutTheLandmarksNames) {
  Honesty honesty;
  const int seeds = test::trials(10, 2);
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    Scenario scenario = scenario_of(true_robot(s), tour(40.0, s), s);
    scenario.sightings.hide_names = true;
    const Recording recording = recorded(scenario);
    honesty.add(calibrate_from_landmarks({&recording, 1}, {}, nominal_robot()), scenario.truth);
  }
  honesty.expect_honest();
}

// The robot file knows nothing of a gyro's bias of 0.7°/s, looks come once a second and the sensor is coarse:
// what the filter takes landmarks for at first is often wrong.
TEST(LandmarkCalibration, TellsLandmarksApartAgainWithTheRobotThatItFound) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Honesty honesty;
  const int seeds = test::trials(16, 2);
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    Scenario scenario = scenario_of(true_robot(s), tour(40.0, s), s);
    scenario.sightings = {.rate_hz = 1.0, .hide_names = true, .give_map = false};
    scenario.nominal.landmark_sensor = scenario.truth.landmark_sensor =
        LandmarkSensor{{0.1, 0.0, 0.0}, 0.03, radians(1.5), 4.0, 0.0};
    scenario.nominal.chassis.gyro = scenario.truth.chassis.gyro = Gyro{};
    scenario.truth.chassis.gyro->bias_rad_s = 0.012;
    const Recording recording = recorded(scenario);
    honesty.add(calibrate_from_landmarks({&recording, 1}, {}, scenario.nominal), scenario.truth);
  }
  honesty.expect_honest();
}

constexpr Parameter kRangeOffset{ParameterKind::sensor_range_offset, -1};
constexpr Parameter kRangeScale{ParameterKind::sensor_range_scale, -1};
constexpr Parameter kBearingOffset{ParameterKind::sensor_bearing_offset, -1};
constexpr Parameter kDepthShare{ParameterKind::sensor_depth_share, -1};
constexpr Parameter kClock{ParameterKind::sensor_time_offset, -1};
constexpr Parameter kSensorX{ParameterKind::sensor_x, -1};
constexpr Parameter kSensorY{ParameterKind::sensor_y, -1};

// A scanner that is read late, whose ranges start at its housing, and that is mounted a little askew.
Scenario crooked_scenario(std::uint64_t seed) {
  Scenario scenario = scenario_of(nominal_robot(), tour(40.0, seed), seed);
  scenario.sightings.rate_hz = 5.0;
  LandmarkSensor& sensor = *scenario.truth.landmark_sensor;
  sensor.range_offset_m = 0.05;
  sensor.bearing_offset_rad = radians(2.0);
  sensor.time_offset_s = -0.4;
  return scenario;
}

double rms_m(const Trajectory& trajectory, const Scenario& scenario) {
  const Trajectory truth = simulate(scenario).truth.body;
  double sum = 0.0;
  std::size_t j = 0;
  for (const StampedPose& stamped : trajectory.poses) {
    while (j + 1 < truth.poses.size() && truth.poses[j].time_s < stamped.time_s) ++j;
    const Pose2 apart = truth.poses.front().pose.inverse() * truth.poses[j].pose;
    sum += (apart.translation() - stamped.pose.translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(trajectory.poses.size()));
}

/// Each is found within four of its sigmas; the sum of the squares of the errors over these.
double squared_sigmas(std::span<const Parameter> wanted, const CalibrationResult& result,
                      const Robot& truth) {
  double squares = 0.0;
  for (const Parameter& parameter : wanted) {
    const ParameterEstimate& e = of(result, parameter);
    EXPECT_TRUE(e.observable) << e.name;
    const double z = (e.value - value_of(parameter, truth)) / e.sigma_within;
    EXPECT_LT(std::abs(z), 4.0) << e.name << " " << e.value << " ± " << e.sigma_within;
    squares += z * z;
  }
  return squares;
}

TEST(LandmarkCalibration, FindsWhatTheSensorErrsByAndItsClock) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const std::vector<Parameter> wanted = {kRangeOffset, kBearingOffset, kClock};
  const int seeds = test::trials(6, 1);
  double squares = 0.0, smoothed_m = 0.0, filtered_m = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Scenario scenario = crooked_scenario(static_cast<std::uint64_t>(seed));
    const Recording recording = recorded(scenario);
    const CalibrationResult result = calibrate_from_landmarks(
        {&recording, 1}, {}, nominal_robot(),
        {.free = {"sensor.range_offset", "sensor.bearing_offset", "sensor.time_offset"}});
    squares += squared_sigmas(wanted, result, scenario.truth);
    const SlamInput input = slam_input(recording, result.calibrated);
    const SlamResult filtered = slam(input, *result.calibrated.landmark_sensor, {.method = SlamMethod::ekf});
    const SmoothedSlam smoothed = smooth(input, *result.calibrated.landmark_sensor, filtered);
    smoothed_m += rms_m(smoothed.trajectory, scenario) / seeds;
    filtered_m += rms_m(filtered.online, scenario) / seeds;
  }
  EXPECT_LE(smoothed_m, filtered_m);
  EXPECT_LT(squares / (3.0 * seeds), 1.0 + 4.0 * std::sqrt(2.0 / (3.0 * seeds)));
}

// In one row of a hundred the rounding of counts is a twist of decimetres a second, and no information.
TEST(LandmarkCalibration, TheClockIsNoSurerThanCoarseCountsAllow) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const int seeds = test::trials(12, 3);
  double squares = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Scenario scenario = crooked_scenario(static_cast<std::uint64_t>(seed));
    for (Robot* robot : {&scenario.nominal, &scenario.truth})
      for (Wheel& wheel : robot->chassis.wheels()) wheel.ticks_per_revolution = 60.0;
    scenario.encoders.rate_hz = 50.0;
    const Recording recording = recorded(scenario);
    squares +=
        squared_sigmas(std::array{kClock},
                       calibrate_from_landmarks(
                           {&recording, 1}, {}, scenario.nominal,
                           {.free = {"sensor.range_offset", "sensor.bearing_offset", "sensor.time_offset"}}),
                       scenario.truth);
  }
  EXPECT_LT(squares / seeds, 1.0 + 4.0 * std::sqrt(2.0 / seeds));
}

TEST(LandmarkCalibration, ARobotThatLagsBehindWhatItIsToldTurnsByAsMuch) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Parameter yaw_scale{ParameterKind::velocity_yaw_scale, -1};
  Recording recording = test::lagging_recording({.lag_s = 0.2, .delay_s = 0.1, .yaw_scale = 0.95}, 5);
  recording.reference = {};
  const CalibrationResult result =
      calibrate_from_landmarks({&recording, 1}, {}, test::told_robot(), {.free = {"sensor.time_offset"}});
  EXPECT_THAT(result.notes, Contains(HasSubstr("velocity.lag_s 0.")));
  EXPECT_NEAR(result.calibrated.chassis.velocity.lag_s, 0.2, 0.03);
  EXPECT_NEAR(result.calibrated.landmark_sensor->time_offset_s, -0.1, 0.03);
  const ParameterEstimate& found = of(result, yaw_scale);
  EXPECT_NEAR(found.value, 0.95, 3.0 * found.sigma_within);
  EXPECT_LT(found.sigma_within, 0.01);
}

TEST(LandmarkCalibration, SetsTheClockOfTheSensorWhereTheLogShowsItOff) {
  Scenario scenario = scenario_of(true_robot(1), tour(40.0, 1), 1);
  scenario.sightings.rate_hz = 5.0;
  Recording recording = recorded(scenario);
  EXPECT_FALSE(calibrate_from_landmarks({&recording, 1}, {}, nominal_robot()).sensor_clock);
  scenario.truth.landmark_sensor->time_offset_s = -0.12;
  recording = recorded(scenario);
  const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, nominal_robot());
  EXPECT_THAT(result.sensor_clock.value_or(""), HasSubstr("landmark_sensor.time_offset_s -0.1"));
  EXPECT_NEAR(result.calibrated.landmark_sensor->time_offset_s, -0.12, 0.02);
  for (const Parameter& parameter : {kLeft, kRight, kTrack}) {
    const ParameterEstimate& e = of(result, parameter);
    EXPECT_NEAR(e.value, value_of(parameter, scenario.truth), 4.0 * e.sigma_within) << e.name;
  }
}

// What is ahead of wheels that are free in all directions is anybody's choice, and so it stays as given.
TEST(LandmarkCalibration, HoldsTheDirectionThatWheelsAndSensorHaveInCommon) {
  Robot nominal;
  nominal.chassis = mecanum({0.1, 1000.0}, 0.3, 0.4);
  nominal.wheel_names = {"fl", "fr", "rl", "rr"};
  nominal.landmark_sensor = nominal_robot().landmark_sensor;
  nominal.landmark_sensor->body_from_sensor = {0.15, 0.0, 0.0};
  Scenario scenario = scenario_of(nominal, tour(20.0, 2), 2);
  scenario.nominal = nominal;
  const Recording seen = recorded(scenario);
  const CalibrationResult result =
      calibrate_from_landmarks({&seen, 1}, {}, nominal, {.free = {"sensor.bearing_offset"}});
  EXPECT_EQ(result.status, CalibrationStatus::some_held);
  EXPECT_THAT(result.unobservable, Contains(HasSubstr("rr.direction in common")));
  double common = 0.0;
  for (const Wheel& wheel : result.calibrated.chassis.wheels()) common += wheel.direction_rad;
  EXPECT_NEAR(common, 0.0, 1e-9);
}

// Nor is it known where the middle of omni wheels is, or which way ahead, once the sensor's place is sought
// too: of eight such recordings six were refused.
TEST(LandmarkCalibration, HoldsTheMiddleOfOmniWheelsWhereTheSensorsPlaceIsFree) {
  Robot nominal;
  nominal.chassis = omni3({0.1, 2000.0}, 0.2);
  nominal.wheel_names = {"a", "b", "c"};
  nominal.landmark_sensor = nominal_robot().landmark_sensor;
  nominal.landmark_sensor->body_from_sensor = {0.12, -0.05, 0.35};
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(test::trials(6, 2)); ++seed) {
    Scenario scenario = scenario_of(nominal, tour(20.0, seed), seed);
    scenario.nominal = nominal;
    const Recording seen = recorded(scenario);
    const CalibrationResult result = calibrate_from_landmarks({&seen, 1}, {}, nominal, {.free = {"sensor"}});
    EXPECT_EQ(result.status, CalibrationStatus::some_held);
    EXPECT_THAT(result.unobservable, Contains(HasSubstr("a.direction, b.direction, c.direction in common")));
    EXPECT_THAT(result.unobservable, Contains(HasSubstr("--fix sensor.x --fix sensor.y")));
    for (const ParameterEstimate& e : result.parameters)
      EXPECT_NEAR(e.value, value_of(e.parameter, nominal), 4.5 * e.sigma_within + 1e-12)
          << e.name << ' ' << seed;
  }
}

// All that changes with the axes and the origin is held at once: one after the other took what the rest says
// of the sensor's place with it, which was held 4 cm off, and left diameters off by 8 sigmas.
TEST(LandmarkCalibration, FindsWhereTheSensorOfOmniWheelsStands) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  namespace oracle = test::drifting_gyro;
  oracle::Machine machine = oracle::with_landmark_sensor(oracle::omni_machine());
  machine.nominal.landmark_sensor->body_from_sensor = {0.04, -0.04, 0.0};
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(test::trials(3, 1)); ++seed) {
    const oracle::Driven run = oracle::driven(machine, {.runs = 1, .landmarks = true}, seed);
    const CalibrationResult result =
        calibrate_from_landmarks(run.recordings, {}, machine.nominal, {.free = {"sensor"}});
    for (const ParameterEstimate& e : result.parameters) {
      const double error = e.value - value_of(e.parameter, machine.truth);
      if (e.parameter.kind == ParameterKind::diameter) {
        EXPECT_LT(std::abs(error), 4.5 * e.sigma_within) << e.name << ' ' << seed;
      }
      if (e.parameter != kSensorX && e.parameter != kSensorY) continue;
      EXPECT_TRUE(e.observable) << e.name << ' ' << seed;
      EXPECT_LT(std::abs(error), 0.015) << e.name << ' ' << seed;  // the origin is that of the nominal levers
    }
  }
}

/// By how much parameters change where the same robot is described about an origin `at`, per metre.
Eigen::VectorXd change_by_origin(std::span<const Parameter> parameters, const Robot& robot,
                                 const Vector2& at) {
  Robot moved = robot;
  for (Wheel& wheel : moved.chassis.wheels()) {
    wheel.x_m -= at.x();
    wheel.y_m -= at.y();
  }
  moved.landmark_sensor->body_from_sensor.x -= at.x();
  moved.landmark_sensor->body_from_sensor.y -= at.y();
  Eigen::VectorXd change(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t j = 0; j < parameters.size(); ++j)
    change[static_cast<Eigen::Index>(j)] =
        (value_of(parameters[j], moved) - value_of(parameters[j], robot)) / at.norm();
  return change;
}

TEST(LandmarkCalibration, WhatChangesWithTheOriginIsWhatADescriptionAboutAnotherOneChanges) {
  Robot robot;
  robot.chassis = omni3({0.1, 2000.0}, 0.2);
  robot.wheel_names = {"a", "b", "c"};
  robot.landmark_sensor = nominal_robot().landmark_sensor;
  const std::vector<Parameter> parameters = parameters_of(robot);
  const auto moved = calibration::origin_moved(parameters, robot);
  ASSERT_EQ(moved.size(), 2U);
  EXPECT_LT((moved[0] - change_by_origin(parameters, robot, {0.01, 0.0})).norm(), 1e-9);
  EXPECT_LT((moved[1] - change_by_origin(parameters, robot, {0.0, 0.01})).norm(), 1e-9);
  const auto no_sensor = [](const Parameter& p) { return is_of_landmark_sensor(p.kind); };
  std::vector<Parameter> of_wheels = parameters;
  std::erase_if(of_wheels, no_sensor);
  EXPECT_TRUE(calibration::origin_moved(of_wheels, robot).empty());
}

// A camera that tells depths, all of it unknown: with the errors of the one above, all at once.
TEST(LandmarkCalibration, FindsThatACameraReadsDepths) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const std::vector<Parameter> wanted = {kDepthShare, kRangeOffset, kBearingOffset,
                                         kSensorX,    kSensorY,     kClock};
  const int seeds = test::trials(8, 2);
  double squares = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    Scenario scenario = crooked_scenario(static_cast<std::uint64_t>(seed));
    scenario.truth.landmark_sensor->depth_share = 1.0;
    scenario.sightings.field_of_view_rad = radians(70.0);
    const Recording recording = recorded(scenario);
    const CalibrationResult result =
        calibrate_from_landmarks({&recording, 1}, {}, nominal_robot(), {.free = {"sensor"}});
    squares += squared_sigmas(wanted, result, scenario.truth);
    EXPECT_LT(of(result, kDepthShare).sigma_within, 0.1);
  }
  const double all = static_cast<double>(wanted.size()) * seeds;
  EXPECT_LT(squares / all, 1.0 + 4.0 * std::sqrt(2.0 / all));
}

TEST(LandmarkCalibration, FindsWhereTheSensorStands) {
  Scenario scenario = scenario_of(nominal_robot(), tour(40.0, 8), 8);
  scenario.sightings.rate_hz = 5.0;
  scenario.truth.landmark_sensor->body_from_sensor.x += 0.05;
  scenario.truth.landmark_sensor->body_from_sensor.y -= 0.03;
  const Recording recording = recorded(scenario);
  const CalibrationResult result =
      calibrate_from_landmarks({&recording, 1}, {}, nominal_robot(), {.free = {"sensor.x", "sensor.y"}});
  for (const Parameter& parameter : {kSensorX, kSensorY}) {
    const ParameterEstimate& e = of(result, parameter);
    EXPECT_TRUE(e.observable) << e.name;
    EXPECT_NEAR(e.value, value_of(parameter, scenario.truth), 4.0 * e.sigma_within) << e.name;
  }
}

TEST(LandmarkCalibration, FindsAScaleOfRangesOnlyAgainstKnownWheels) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Scenario scenario = scenario_of(nominal_robot(), tour(40.0, 9), 9);
  scenario.truth.landmark_sensor->range_scale = 1.03;
  const Recording recording = recorded(scenario);
  const CalibrationResult fixed =
      calibrate_from_landmarks({&recording, 1}, {}, nominal_robot(),
                               {.free = {"sensor.range_scale"}, .fix = {"left.diameter", "right.diameter"}});
  const ParameterEstimate& e = of(fixed, kRangeScale);
  EXPECT_TRUE(e.observable);
  EXPECT_NEAR(e.value, 1.03, 4.0 * e.sigma_within);
  // Where the sensor stands on the robot is a length, too: in the middle it is none.
  scenario.nominal.landmark_sensor->body_from_sensor = {};
  scenario.truth.landmark_sensor->body_from_sensor = {};
  const Recording centred = recorded(scenario);
  const CalibrationResult both =
      calibrate_from_landmarks({&centred, 1}, {}, scenario.nominal, {.free = {"sensor.range_scale"}});
  EXPECT_EQ(both.status, CalibrationStatus::some_held);
  EXPECT_FALSE(both.unobservable.empty());
}

/// With ranges 3 % and 5 cm too long, and a reference that sees a point beside the middle.
Scenario referenced_scenario(std::uint64_t seed) {
  Scenario scenario = scenario_of(true_robot(seed), tour(40.0, seed), seed);
  LandmarkSensor& sensor = *scenario.truth.landmark_sensor;
  sensor.range_scale = 1.03;
  sensor.range_offset_m = 0.05;
  sensor.bearing_offset_rad = radians(2.0);
  scenario.nominal.body_from_reference = scenario.truth.body_from_reference = {0.1, 0.05, 0.0};
  scenario.reference = {.rate_hz = 10.0, .position_sigma_m = 0.02};
  return scenario;
}

TEST(LandmarkCalibration, FindsAScaleOfRangesByThePositionsOfAReference) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Honesty honesty;
  std::vector<Parameter> wanted = {kRangeScale, kRangeOffset, kBearingOffset};
  const int seeds = test::trials(40, 2);
  double squares = 0.0;
  for (int seed = 1; seed <= seeds; ++seed) {
    const Scenario scenario = referenced_scenario(static_cast<std::uint64_t>(seed));
    const Recording recording = recorded(scenario);
    const CalibrationResult result = calibrate_from_landmarks(
        {&recording, 1}, {}, scenario.nominal,
        {.free = {"sensor.range_offset", "sensor.bearing_offset"}, .with_reference = true});
    EXPECT_LT(of(result, kRangeScale).sigma_within, 0.01);
    squares += squared_sigmas(wanted, result, scenario.truth);
    honesty.add(result, scenario.truth);
  }
  honesty.expect_honest();
  EXPECT_NEAR(squares / (3.0 * seeds), 1.0, 4.0 * std::sqrt(2.0 / (3.0 * seeds)));
}

// What a position leaves depends on the pose as small moves of it say.
TEST(LandmarkCalibration, DerivativesOfPositionsAreThoseOfSmallMoves) {
  const PositionLink link{.position = {3.0, -1.0}, .on_body = {0.3, -0.2}, .sigma_m = 0.05};
  Random random(5, 2);
  for (int trial = 0; trial < 50; ++trial) {
    const Pose2 pose{random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-9.0, 9.0)};
    const PositionResidual r = position_residual(link, {{pose}, {}, {}});
    for (int i = 0; i < 3; ++i) {
      const auto error = [&](double by) {
        return position_residual(link, {{moved_by(by * Vector3::Unit(i), pose)}, {}, {}}).error;
      };
      EXPECT_LT(((error(1e-6) - error(-1e-6)) / 2e-6 - r.by_pose.col(i)).norm(), 1e-4 * r.by_pose.norm());
    }
  }
}

TEST(LandmarkCalibration, PositionsThatAreMissingOrWrongDoNotMislead) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Scenario scenario = referenced_scenario(3);
  Recording recording = recorded(scenario);
  const CalibrateOptions options{.free = {"sensor.range_offset", "sensor.bearing_offset"},
                                 .with_reference = true};
  const std::vector<Parameter> wanted = {kRangeScale, kRangeOffset, kBearingOffset};
  ReferenceStream& reference = recording.reference;
  const std::size_t n = reference.time_s.size();
  for (std::size_t i = n / 2; i < n / 2 + n / 20; ++i) reference.x_m[i] += 2.0;  // it saw something else
  for (std::size_t i = n / 4; i < n / 3; ++i) reference.x_m[i] = reference.y_m[i] = recording::kNotMeasured;
  const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, scenario.nominal, options);
  EXPECT_LT(squared_sigmas(wanted, result, scenario.truth), chi_squared_limit(1e-4, 3.0));
  // Beside one that has no reference, whose map is its own.
  const Recording without = recorded(scenario_of(scenario.truth, tour(20.0, 4), 4));
  const std::vector<Recording> both = {recording, without};
  EXPECT_LT(
      squared_sigmas(wanted, calibrate_from_landmarks(both, {}, scenario.nominal, options), scenario.truth),
      chi_squared_limit(1e-4, 3.0));
  EXPECT_THROW(calibrate_from_landmarks({&without, 1}, {}, scenario.nominal, options), CannotAnswer);
}

/// A robot whose motion somebody else computed, among landmarks.
Scenario velocity_scenario(std::uint64_t seed) {
  Scenario scenario = scenario_of(nominal_robot(), tour(40.0, seed), seed);
  scenario.nominal = test::nominal_velocity();
  scenario.truth = test::true_velocity(seed);
  scenario.nominal.landmark_sensor = scenario.truth.landmark_sensor = nominal_robot().landmark_sensor;
  return scenario;
}

TEST(LandmarkCalibration, FindsWhatAVelocityErrsByWithinItsOwnSigmas) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  test::VelocityEvidence evidence;
  for (int seed = 1; seed <= test::trials(40, 3); ++seed) {
    const Scenario scenario = velocity_scenario(static_cast<std::uint64_t>(seed));
    const Recording recording = recorded(scenario);
    const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, scenario.nominal);
    EXPECT_EQ(result.status, CalibrationStatus::all_estimated);
    evidence.add(result.calibrated, result.covariance_within, scenario.truth);
  }
  evidence.expect_consistent();
}

TEST(LandmarkCalibration, FindsTheScaleOfAVelocityOrThatOfRangesAndNotBoth) {
  Scenario scenario = velocity_scenario(3);
  scenario.nominal.landmark_sensor->body_from_sensor = {};
  scenario.truth.landmark_sensor->body_from_sensor = {};
  const Recording recording = recorded(scenario);
  const CalibrationResult both =
      calibrate_from_landmarks({&recording, 1}, {}, scenario.nominal, {.free = {"sensor.range_scale"}});
  EXPECT_EQ(both.status, CalibrationStatus::some_held);
  EXPECT_THAT(both.unobservable,
              Contains(testing::AnyOf(HasSubstr("velocity.forward_scale"), HasSubstr("sensor.range_scale"))));
  EXPECT_THAT(calibrate_from_landmarks({&recording, 1}, {}, scenario.nominal).notes,
              Contains(HasSubstr("a common error of its ranges is one of velocity.forward_scale")));
}

// What the calibration leaves open stays a systematic error of the smoother, and there is no other.
TEST(LandmarkCalibration, MakesOdometryOfAVelocityAndTheSmootherBetter) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  double before_m = 0.0, after_m = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Scenario scenario = velocity_scenario(seed);
    const Recording recording = recorded(scenario);
    const Robot found = calibrate_from_landmarks({&recording, 1}, {}, scenario.nominal).calibrated;
    before_m += rms_m(odometry::integrate(recording, scenario.nominal).trajectory, scenario);
    after_m += rms_m(odometry::integrate(recording, found).trajectory, scenario);
    EXPECT_FALSE(slam_input(recording, found).systematic.has_shares);
    EXPECT_TRUE(slam_input(recording, scenario.nominal).systematic.has_shares);
  }
  EXPECT_LT(after_m, 0.3 * before_m);
}

TEST(LandmarkCalibration, HoldsWhatTheRunCannotShow) {
  const Recording recording = recorded(scenario_of(nominal_robot(), straight(3.0), 3));
  const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, nominal_robot());
  EXPECT_EQ(result.status, CalibrationStatus::some_held);
  EXPECT_FALSE(of(result, kTrack).observable);
  EXPECT_EQ(of(result, kTrack).value, of(result, kTrack).nominal);
  EXPECT_THAT(result.unobservable, Contains(HasSubstr("track")));
}

TEST(LandmarkCalibration, ComparesWithAReferenceThatItDoesNotUse) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Scenario scenario = scenario_of(true_robot(4), tour(20.0, 4), 4);
  const Recording without = recorded(scenario);
  scenario.reference.rate_hz = 4.0;
  const Recording with = recorded(scenario);
  const CalibrationResult blind = calibrate_from_landmarks({&without, 1}, {}, nominal_robot());
  const CalibrationResult result = calibrate_from_landmarks({&with, 1}, {&with, 1}, nominal_robot());
  EXPECT_EQ(of(result, kTrack).value, of(blind, kTrack).value);
  ASSERT_EQ(result.runs.size(), 2u);
  EXPECT_LT(result.runs.front().after->position_rms_m, 0.3 * result.runs.front().before->position_rms_m);
}

/// It could drive sideways and did not. What the noise of its wheels, one of them four times as bad as
/// another, makes of how motions and gyro depend on their directions is no information: taken for that it
/// found wheels turned by a radian, or did not settle.
TEST(LandmarkCalibration, FindsNoWheelInNoise) {
  Robot nominal = test::nominal_omni3();
  nominal.landmark_sensor = nominal_robot().landmark_sensor;
  nominal.chassis.gyro = Gyro{};
  const double noise[] = {0.008, 0.03, 0.012};
  for (std::size_t w = 0; w < 3; ++w) nominal.chassis.wheels()[w].noise_per_sqrt_m = noise[w];
  const int seeds = test::trials(8, 1);
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    Random random(s, 34);
    Robot truth = nominal;
    for (int w = 0; w < 3; ++w)
      set_value({ParameterKind::diameter, w}, 0.1 * (1.0 + random.normal(0.005)), truth);
    Scenario scenario = scenario_of(truth, tour(60.0, s), s);
    scenario.nominal = nominal;
    scenario.encoders.rate_hz = 20.0;
    const Recording recording = recorded(scenario);
    const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, nominal);
    for (const ParameterEstimate& e : result.parameters) {
      if (!e.observable) continue;
      EXPECT_LT(std::abs(e.value - value_of(e.parameter, truth)), 4.0 * e.sigma_total)
          << "seed " << seed << ": " << e.name << " " << e.value << " ± " << e.sigma_total;
    }
  }
}

TEST(LandmarkCalibration, TellsTheSpreadBetweenSessions) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  std::vector<Recording> recordings;
  for (std::uint64_t session = 0; session < 3; ++session) {
    Robot truth = true_robot(5);
    set_value(kTrack, value_of(kTrack, truth) + 0.01 * static_cast<double>(session), truth);
    recordings.push_back(recorded(scenario_of(truth, tour(30.0, session), session)));
    recordings.back().session = std::to_string(session);
  }
  const CalibrationResult result = calibrate_from_landmarks(recordings, {}, nominal_robot());
  EXPECT_EQ(result.sessions, 3);
  EXPECT_NEAR(of(result, kTrack).sigma_between.value(), 0.01, 0.003);
}

TEST(LandmarkCalibration, SaysSoWhereReadingsScatterMoreThanTheRobotFileClaims) {
  Scenario scenario = scenario_of(true_robot(6), tour(20.0, 6), 6);
  scenario.truth.landmark_sensor->range_sigma_m *= 3.0;
  scenario.truth.landmark_sensor->bearing_sigma_rad *= 3.0;
  const Recording recording = recorded(scenario);
  const CalibrationResult result = calibrate_from_landmarks({&recording, 1}, {}, nominal_robot());
  EXPECT_THAT(result.warnings, Contains(HasSubstr("times as much")));
  for (const Parameter& parameter : {kLeft, kRight, kTrack}) {
    const ParameterEstimate& e = of(result, parameter);
    EXPECT_NEAR(e.value, value_of(parameter, scenario.truth), 4.0 * e.sigma_within) << e.name;
  }
}

// Sizes of wheels take up what they can of an error of the sensor, and their ± do not know of it.
TEST(LandmarkCalibration, NamesAnErrorOfTheSensorThatIsNotFree) {
  Scenario scenario = scenario_of(true_robot(7), tour(40.0, 7), 7);
  const auto warnings = [&](std::vector<std::string> free) {
    const Recording recording = recorded(scenario);
    return calibrate_from_landmarks({&recording, 1}, {}, nominal_robot(), {.free = std::move(free)}).warnings;
  };
  EXPECT_THAT(warnings({}), Not(Contains(HasSubstr("--free sensor."))));
  scenario.truth.landmark_sensor->range_offset_m = 0.08;
  EXPECT_THAT(warnings({}), Contains(HasSubstr("--free sensor.range_offset")));
  EXPECT_THAT(warnings({"sensor.range_offset"}), Not(Contains(HasSubstr("--free sensor."))));
  scenario.truth.landmark_sensor->range_offset_m = 0.0;
  scenario.truth.landmark_sensor->bearing_offset_rad = radians(2.0);
  EXPECT_THAT(warnings({}), Contains(HasSubstr("--free sensor.bearing_offset")));
  EXPECT_THAT(warnings({"sensor"}), Not(Contains(HasSubstr("--free sensor."))));
}

TEST(LandmarkCalibration, RefusesWhatCannotAnswer) {
  Scenario scenario = scenario_of(nominal_robot(), straight(1.0), 7);
  scenario.sightings.rate_hz = 0.0;
  const Recording blind = recorded(scenario);
  EXPECT_THROW(calibrate_from_landmarks({&blind, 1}, {}, nominal_robot()), CannotAnswer);
  const Recording seeing = recorded(scenario_of(nominal_robot(), straight(1.0), 7));
  EXPECT_THROW(calibrate_from_landmarks({&seeing, 1}, {}, test::nominal_differential()), InputError);
  EXPECT_THROW(calibrate_from_landmarks({&seeing, 1}, {}, nominal_robot(), {.free = {"trck"}}), InputError);
  EXPECT_THROW(calibrate_from_landmarks({&seeing, 1}, {}, nominal_robot(),
                                        {.fix = {"left.diameter", "right.diameter", "track"}}),
               CannotAnswer);
}

}  // namespace
}  // namespace trundle::slam
