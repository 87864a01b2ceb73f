#include "trundle/slam/steps.hpp"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/slam/step_cutter.hpp"

namespace trundle::slam {
namespace {

Robot robot_with_sensor() {
  Robot robot;
  robot.name = "sample";
  robot.chassis = differential_drive({0.1, 0.0, 0}, 0.3);
  robot.wheel_names = {"left", "right"};
  robot.landmark_sensor = LandmarkSensor{{0.1, 0.0, 0.0}, 0.05, 0.01, 5.0, 0.0};
  return robot;
}

/// A figure of eight with sightings at 3 Hz, wheels at 20 Hz: most sightings lie between rows.
Recording drive(const Robot& robot, double sensor_delay_s = 0.0) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot;
  scenario.truth.landmark_sensor->time_offset_s = sensor_delay_s;
  scenario.truth.chassis.noise = {0.0, 0.0, 0.0, 0.0, 0.0};
  scenario.path = figure_eight(1.0, {.forward_m_s = 0.5});
  scenario.encoders = {.rate_hz = 20.0, .unit = WheelUnit::metres, .quantised = false};
  scenario.sightings.rate_hz = 3.0;
  scenario.landmarks = {{"a", {1.0, 2.0}}, {"b", {-1.0, -2.0}}, {"c", {2.5, 0.0}}};
  return simulate(scenario).recording;
}

Pose2 end_of(const SlamInput& input) {
  Pose2 pose;
  for (const SlamStep& step : input.steps) pose = pose * step.motion.mean;
  return pose;
}

TEST(Steps, ComposeToTheOdometry) {
  const Robot robot = robot_with_sensor();
  const Recording recording = drive(robot);
  const SlamInput input = slam_input(recording, robot);
  const IntegratedOdometry odometry = integrate(recording, robot);
  const Pose2 error = odometry.trajectory.poses.back().pose.inverse() * end_of(input);
  EXPECT_LT(error.translation().norm(), 1e-9);
  EXPECT_NEAR(error.heading, 0.0, 1e-9);
  Motion motion;
  for (const SlamStep& step : input.steps) motion = motion * step.motion;
  const GaussianPose sum{motion.mean, motion.covariance};
  const Matrix3 expected = odometry.end_white_covariance;
  // Each cut adds the floors of the readings' noise once more.
  EXPECT_LT((world_covariance(sum) - expected).norm(), 1e-3 * expected.norm());
}

// Where another robot is seen, or sees this one: between rows, at a stamp of a sighting, and beyond the
// odometry.
TEST(Steps, AreCutWhereAsked) {
  const Robot robot = robot_with_sensor();
  const Recording recording = drive(robot);
  const double seen_s = recording.sightings.front().time_s;
  const std::vector<double> asked = {-1.0, 0.7123, seen_s, 2.34567, 1e6};
  const SlamInput plain = slam_input(recording, robot);
  const SlamInput cut = slam_input(recording, robot, {.also_at_s = asked});
  const auto at = [&](double time_s) { return std::ranges::count(cut.steps, time_s, &SlamStep::time_s); };
  EXPECT_EQ(at(0.7123), 1);
  EXPECT_EQ(at(2.34567), 1);
  EXPECT_EQ(at(seen_s), 1);
  EXPECT_EQ(at(-1.0) + at(1e6), 0);
  EXPECT_EQ(cut.observations(), plain.observations());
  EXPECT_LT((end_of(cut).translation() - end_of(plain).translation()).norm(), 1e-9);
}

// Where another robot is seen, or sees this one, in the very first instant: a step in which nothing has moved
// yet. What is asked for before is left out.
TEST(Steps, AreCutAtTheFirstStampWhereAsked) {
  const Robot robot = robot_with_sensor();
  Recording recording = drive(robot);
  const double start_s = slam_input(recording, robot).start_s;
  std::erase_if(recording.sightings, [&](const Sighting& sighting) { return sighting.time_s <= start_s; });
  const SlamInput plain = slam_input(recording, robot);
  ASSERT_GT(plain.steps.front().time_s, start_s);
  const SlamInput before = slam_input(recording, robot, {.also_at_s = {start_s - 1.0, start_s - 1e-3}});
  EXPECT_EQ(before.steps.size(), plain.steps.size());
  EXPECT_EQ(before.steps.front().time_s, plain.steps.front().time_s);
  for (const std::vector<double>& asked :
       {std::vector{start_s}, std::vector{start_s - 1.0, start_s}, std::vector{start_s, start_s}}) {
    const SlamInput cut = slam_input(recording, robot, {.also_at_s = asked});
    ASSERT_EQ(cut.steps.size(), plain.steps.size() + 1);
    EXPECT_EQ(cut.steps.front().time_s, start_s);
    EXPECT_TRUE(cut.steps.front().observations.empty());
    EXPECT_EQ(log(cut.steps.front().motion.mean).vector().norm(), 0.0);
    EXPECT_EQ(cut.steps[1].time_s, plain.steps.front().time_s);
    EXPECT_LT((end_of(cut).translation() - end_of(plain).translation()).norm(), 1e-12);
  }
  // One step, where something is seen then anyway.
  recording.sightings.insert(recording.sightings.begin(), {start_s, "a", 1.0, 0.0});
  const SlamInput both = slam_input(recording, robot, {.also_at_s = {start_s}});
  EXPECT_EQ(both.steps.size(), plain.steps.size() + 1);
  EXPECT_EQ(both.steps.front().time_s, start_s);
  EXPECT_EQ(both.steps.front().observations.size(), 1U);
}

TEST(Steps, AreCutWhereSomethingIsSeen) {
  const Robot robot = robot_with_sensor();
  const Recording recording = drive(robot);
  const SlamInput input = slam_input(recording, robot);
  EXPECT_EQ(input.observations(), recording.sightings.size());
  EXPECT_EQ(input.landmarks.size(), 3U);
  double before = input.start_s;
  std::size_t next = 0;
  for (const SlamStep& step : input.steps) {
    EXPECT_LE(step.time_s - before, 0.1 + 0.05);  // the limit, and an interval of the wheels
    before = step.time_s;
    for (const Observation& observation : step.observations) {
      const Sighting& sighting = recording.sightings[next++];
      EXPECT_EQ(sighting.time_s, step.time_s);
      EXPECT_EQ(sighting.landmark, input.landmarks[static_cast<std::size_t>(observation.landmark)]);
    }
  }
}

/// Without any noise, every reading is what its step's pose says: cutting and offsets are exact.
void expect_exact(const Recording& recording, const Robot& robot) {
  const SlamInput input = slam_input(recording, robot);
  Pose2 pose;
  double worst = 0.0;
  for (const SlamStep& step : input.steps) {
    pose = pose * step.motion.mean;
    for (const Observation& observation : step.observations) {
      const std::string& name = input.landmarks[static_cast<std::size_t>(observation.landmark)];
      const auto truth = std::ranges::find(recording.landmarks, name, &Landmark::name);
      const ExpectedReading expected =
          expected_reading(pose, robot.landmark_sensor->body_from_sensor, truth->position);
      worst = std::max(worst, innovation_of(observation, expected).norm());
    }
  }
  EXPECT_LT(worst, 1e-6);
}

/// Of a robot that has speeded up evenly, left and right wheel [m], and then stands.
Vector2 travelled(double time_s) {
  const double moving_s = std::min(time_s, 1.0);
  return 0.5 * moving_s * moving_s * Vector2(0.6, 0.9);
}

Increment speeding_up(const Robot& robot, double time_s, double duration_s) {
  const Vector2 travel = (travelled(time_s) - travelled(time_s - duration_s)) / (kPi * 0.1);
  const double turn = (travel[1] - travel[0]) * kPi * 0.1 / 0.3;
  Increment increment{.time_s = time_s, .duration_s = duration_s, .turned = {travel[0], travel[1]}};
  increment.gyro_rad = turn;
  increment.has_gyro = robot.chassis.gyro.has_value();
  return increment;
}

TEST(Steps, BetweenRowsOfTheWheelsTheyGoOnSpeedingUp) {
  Robot robot = robot_with_sensor();
  for (const bool has_gyro : {false, true}) {
    if (has_gyro) robot.chassis.gyro = Gyro{};
    StepCutter cutter(robot, {});
    cutter.start(0.0);
    for (const double seen_s : {0.137, 0.45, 0.993, 1.05, 1.12}) cutter.add_sighting({seen_s, "a", 1.0, 0.0});
    for (int i = 1; i <= 13; ++i) cutter.advance(speeding_up(robot, 0.1 * i, 0.1), false);
    cutter.finish();
    Pose2 pose;
    for (const SlamStep& step : cutter.take().steps) {
      pose = pose * step.motion.mean;
      const Vector2 travel = travelled(step.time_s);
      const Pose2 truth = exp(Twist2{travel.mean(), 0.0, (travel[1] - travel[0]) / 0.3});
      // From 1 s on it stands: no wheel turns back.
      EXPECT_NEAR((pose.translation() - truth.translation()).norm(), 0.0, 1e-12) << step.time_s;
      EXPECT_NEAR(pose.heading, truth.heading, 1e-12) << step.time_s;
    }
  }
}

TEST(Steps, SightingsLieWhereTheRobotWas) {
  Robot robot = robot_with_sensor();
  robot.landmark_sensor->range_sigma_m = robot.landmark_sensor->bearing_sigma_rad = 1e-12;
  expect_exact(drive(robot), robot);
}

TEST(Steps, TheSensorsTimeOffsetIsApplied) {
  Robot robot = robot_with_sensor();
  robot.landmark_sensor->range_sigma_m = robot.landmark_sensor->bearing_sigma_rad = 1e-12;
  const Recording late = drive(robot, 0.13);
  robot.landmark_sensor->time_offset_s = 0.13;
  expect_exact(late, robot);
}

TEST(Steps, SightingsOutsideAreReported) {
  const Robot robot = robot_with_sensor();
  Recording recording = drive(robot);
  const std::size_t inside = recording.sightings.size();
  recording.sightings.push_back({-5.0, "a", 1.0, 0.0});
  recording.sightings.push_back({1e6, "a", 1.0, 0.0});
  const SlamInput input = slam_input(recording, robot);
  EXPECT_EQ(input.observations(), inside);
  ASSERT_EQ(input.findings.size(), 1U);
  EXPECT_EQ(input.findings[0].count, 2U);
}

using Reading = std::tuple<LandmarkId, double, double>;
std::multiset<Reading> readings_of(const SlamStep& step) {
  std::multiset<Reading> readings;
  for (const Observation& o : step.observations) readings.insert({o.landmark, o.range_m, o.bearing_rad});
  return readings;
}

TEST(Steps, SightingsMayBeInAnyOrderAndToldTwice) {
  const Robot robot = robot_with_sensor();
  const Recording recording = drive(robot);
  const SlamInput input = slam_input(recording, robot);
  Recording shuffled = recording;
  const std::vector<Sighting>& in_order = recording.sightings;
  shuffled.sightings.insert(shuffled.sightings.end(), in_order.begin(), in_order.end());
  std::rotate(shuffled.sightings.begin(), shuffled.sightings.begin() + 7, shuffled.sightings.end());
  std::ranges::stable_sort(shuffled.sightings, std::greater{}, [](const Sighting& s) {
    return std::llround(s.time_s * 1e3) % 17;  // stamps in disorder, rows of one stamp as they were
  });
  const SlamInput again = slam_input(shuffled, robot, {.names = input.landmarks});
  EXPECT_EQ(again.observations(), input.observations());
  ASSERT_EQ(again.steps.size(), input.steps.size());
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    EXPECT_EQ(again.steps[k].time_s, input.steps[k].time_s);
    EXPECT_EQ(readings_of(again.steps[k]), readings_of(input.steps[k]));
  }
  ASSERT_EQ(again.findings.size(), 1U);
  EXPECT_EQ(again.findings[0].code, FindingCode::repeated_sighting);
  EXPECT_EQ(again.findings[0].count, in_order.size());
}

TEST(Steps, InstantsWithTooManySightingsAreThinnedOutEvenly) {
  const Robot robot = robot_with_sensor();
  Recording recording = drive(robot);
  const double time_s = recording.sightings[50].time_s;
  recording.sightings.clear();
  for (int i = 0; i < 1000; ++i) recording.sightings.push_back({time_s, "a", 1.0 + i, 0.0});
  const SlamInput input = slam_input(recording, robot);
  EXPECT_EQ(input.observations(), kMostSightingsAtOnce);
  for (const SlamStep& step : input.steps)
    for (std::size_t i = 0; i < step.observations.size(); ++i)
      EXPECT_EQ(step.observations[i].range_m, 1.0 + 5.0 * static_cast<double>(i));
  const auto crowded = std::ranges::find(input.findings, FindingCode::crowded_instant, &Finding::code);
  ASSERT_NE(crowded, input.findings.end());
  EXPECT_EQ(crowded->count, 800U);
}

TEST(Steps, RangesInAnotherUnitAreNamed) {
  const Robot robot = robot_with_sensor();
  Recording recording = drive(robot);
  EXPECT_TRUE(slam_input(recording, robot).findings.empty());
  for (Sighting& sighting : recording.sightings) sighting.range_m *= 1000.0;
  const SlamInput input = slam_input(recording, robot);
  ASSERT_EQ(input.findings.size(), 1U);
  EXPECT_EQ(input.findings[0].code, FindingCode::range_unit);
}

TEST(Steps, WhatIsMissingIsNamed) {
  Robot robot = robot_with_sensor();
  Recording recording = drive(robot);
  recording.sightings[3].landmark.clear();
  const SlamInput mixed = slam_input(recording, robot);
  EXPECT_EQ(mixed.observations(), recording.sightings.size());
  EXPECT_TRUE(mixed.has_unidentified());
  ASSERT_EQ(mixed.findings.size(), 1U);
  EXPECT_EQ(mixed.findings[0].code, FindingCode::sighting_without_name);
  EXPECT_EQ(mixed.findings[0].count, 1U);
  EXPECT_TRUE(slam_input(recording, robot, {.hide_ids = true}).findings.empty());
  robot.landmark_sensor.reset();
  EXPECT_THROW((void)slam_input(recording, robot), InputError);
}

}  // namespace
}  // namespace trundle::slam
