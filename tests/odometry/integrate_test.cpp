#include "trundle/odometry/integrate.hpp"

#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "increments.hpp"

namespace trundle::odometry {
namespace {

bool same_bytes(const Matrix3& a, const Matrix3& b) {
  return std::memcmp(a.data(), b.data(), 9 * sizeof(double)) == 0;
}

TEST(Integrate, GivesTheBytesOfTheStep) {
  const Robot robot = test::robot_of(test::with_gyro(differential_drive(test::kSize, 0.5)));
  AlignedReadings readings = test::aligned(test::wandering(robot, 300));
  readings.start_s = 1.0;
  readings.bridged[100] = true;
  const IntegratedOdometry result = integrate(readings, robot, {.start = {1.0, 2.0, 3.0}});
  ASSERT_EQ(result.trajectory.poses.size(), 301U);
  EXPECT_EQ(result.trajectory.poses.front().time_s, 1.0);
  Odometer odometer(robot, {.start = {1.0, 2.0, 3.0}, .learn_gyro_bias = true});
  for (std::size_t i = 0; i < 300; ++i) {
    if (i == 100)
      odometer.step_across_gap(readings.increments[i]);
    else
      odometer.step(readings.increments[i]);
    const Pose2& pose = result.trajectory.poses[i + 1].pose;
    ASSERT_EQ(std::memcmp(&pose, &odometer.pose(), sizeof pose), 0);
    ASSERT_TRUE(same_bytes(result.trajectory.covariances[i + 1], odometer.white_covariance()));
  }
}

TEST(Integrate, ReportsGapsAndMissingGyro) {
  const Robot robot = test::robot_of(test::with_gyro(differential_drive(test::kSize, 0.5)));
  AlignedReadings readings = test::aligned(test::wandering(robot, 10));
  readings.bridged[4] = true;
  test::lose_gyro(7, readings);
  const IntegratedOdometry result = integrate(readings, robot);
  EXPECT_EQ(result.bridged, 1U);
  ASSERT_EQ(result.findings.size(), 2U);
  EXPECT_EQ(result.findings[0].code, FindingCode::bridged_gap);
  EXPECT_EQ(result.findings[1].code, FindingCode::no_gyro);
  EXPECT_EQ(result.findings[1].severity, Severity::note);
  EXPECT_EQ(result.degrees_of_freedom, 1);
}

TEST(Integrate, PathLengthAndNoCovarianceWhenNotAsked) {
  const Robot robot = test::differential_robot();
  AlignedReadings readings;
  for (int i = 0; i < 50; ++i) readings.increments.push_back(test::two_wheels(0.02, 0.02));
  const IntegratedOdometry result = integrate(readings, robot, {.with_covariance = false});
  EXPECT_NEAR(result.path_length_m, 1.0, 1e-12);
  EXPECT_FALSE(result.trajectory.has_covariance());
}

TEST(Integrate, NeedsTheGyroWherePodsAloneCannotTell) {
  const Robot robot = test::robot_of(test::two_pods());
  AlignedReadings readings = test::aligned(test::wandering(robot, 10));
  for (std::size_t i = 0; i < readings.increments.size(); ++i) test::lose_gyro(i, readings);
  EXPECT_THROW(integrate(readings, robot), CannotAnswer);
}

TEST(Integrate, RefusesACalibrationOfAnotherRobot) {
  Robot robot = test::differential_robot();
  robot.calibration = test::calibrated({"gyro.scale"}, Eigen::MatrixXd::Identity(1, 1));
  EXPECT_THROW(integrate(AlignedReadings{}, robot), InputError);
  robot.calibration = test::calibrated({"track"}, Eigen::MatrixXd::Identity(2, 2));
  EXPECT_THROW(integrate(AlignedReadings{}, robot), InputError);
}

TEST(Integrate, ALearnedBiasIsNoParameterAndStartsNoSurerThanTheDataSheet) {
  Robot robot = test::robot_of(test::with_gyro(differential_drive(test::kSize, 0.5)));
  Eigen::Matrix2d covariance;
  covariance << 1e-6, 1e-7, 1e-7, 4e-6;
  robot.calibration = test::calibrated({"track", "gyro.bias"}, covariance);
  const AlignedReadings readings = test::aligned(test::wandering(robot, 10));
  const double walked = std::pow(robot.chassis.gyro->bias_walk_rad_s_sqrt_s, 2) * 0.5;
  const IntegratedOdometry one_session = integrate(readings, robot);
  EXPECT_THAT(one_session.parameters, testing::ElementsAre("track"));
  EXPECT_NEAR(one_session.end_gyro_bias.variance, 0.02 * 0.02 + walked, 1e-12);
  robot.calibration->parameters[1].sigma_between = 0.001;
  EXPECT_NEAR(integrate(readings, robot).end_gyro_bias.variance, 0.02 * 0.02 + walked, 1e-12);
  robot.calibration->parameters[1].sigma_between = 0.003;
  EXPECT_NEAR(integrate(readings, robot).end_gyro_bias.variance, 0.03 * 0.03 + walked, 1e-12);
  EXPECT_THAT(integrate(readings, robot, {.learn_gyro_bias = false}).parameters,
              testing::ElementsAre("track", "gyro.bias"));
}

TEST(Integrate, ReportsDeadEncodersAndADisturbedGyro) {
  const Robot robot = test::robot_of(test::with_gyro(differential_drive(test::kSize, 0.5)));
  std::vector<Increment> increments = test::wandering(robot, 40);
  for (std::size_t i = 10; i < 40; ++i) increments[i].turned[0] = 0.0;
  increments[5].gyro_rad = 1.0;  // 20 rad/s
  const IntegratedOdometry result = integrate(test::aligned(increments), robot);
  ASSERT_EQ(result.findings.size(), 2U);
  EXPECT_EQ(result.findings[0].code, FindingCode::stuck_encoder);
  EXPECT_THAT(describe(result.findings[0]), testing::HasSubstr("'w0'"));
  EXPECT_EQ(result.findings[1].code, FindingCode::gyro_disturbed);
  EXPECT_EQ(result.findings[1].count, 1U);
}

/// A pivot that starts at 1 s: wheels and gyro log it, each with its own clock.
Recording pivot(double wheels_late_s, double gyro_late_s) {
  Recording recording;
  WheelSeries left{"w0", WheelUnit::metres, {}};
  WheelSeries right{"w1", WheelUnit::metres, {}};
  for (int k = 0; k <= 150; ++k) {
    const double t = 0.02 * k;
    const double travel = 0.1 * std::clamp(t - 1.0, 0.0, 1.0);
    recording.wheels.time_s.push_back(t - wheels_late_s);
    left.value.push_back(-travel);
    right.value.push_back(travel);
  }
  recording.wheels.series = {left, right};
  for (int k = 0; k <= 300; ++k) {
    const double t = 0.01 * k;
    recording.gyro.time_s.push_back(t - gyro_late_s);
    recording.gyro.yaw_rate_rad_s.push_back(t > 1.0 && t <= 2.0 ? 0.4 : 0.0);
  }
  return recording;
}

TEST(Integrate, AppliesTheOffsetsOfTheClocks) {
  Robot robot = test::differential_robot(0.5);
  for (Wheel& wheel : robot.chassis.wheels()) wheel.recorded_diameter_m = wheel.diameter_m;
  robot.chassis.gyro = Gyro{};
  const Trajectory expected = integrate(pivot(0.0, 0.0), robot).trajectory;
  robot.chassis.wheels_time_offset_s = 0.3;
  robot.chassis.gyro->time_offset_s = -0.2;
  const Trajectory shifted = integrate(pivot(0.3, -0.2), robot).trajectory;
  for (const double t : {0.5, 1.25, 1.5, 2.5}) {
    const auto a = pose_at(expected, t, 0.5);
    const auto b = pose_at(shifted, t, 0.5);
    ASSERT_TRUE(a && b);
    EXPECT_NEAR(a->heading, b->heading, 1e-9) << t;
  }
  EXPECT_NEAR(pose_at(shifted, 1.5, 0.5)->heading, 0.2, 1e-6);
}

}  // namespace
}  // namespace trundle::odometry
