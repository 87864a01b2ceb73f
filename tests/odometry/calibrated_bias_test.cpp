// A calibration over several sessions is a prior of the gyro's bias, not a reason to refuse a rest; and where
// a rest is refused by the gyro alone, that is said.
#include <cmath>

#include <Eigen/LU>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/odometry/integrate.hpp"
#include "trundle/odometry/standing_gyro.hpp"

#include "scale.hpp"
#include "sensed_drive.hpp"

namespace trundle::odometry {
namespace {

using test::Piece;
using test::robot_with_gyro;
using test::SensedDrive;
using test::with_bias;
using ::testing::HasSubstr;

constexpr double kRate_hz = 20.0;

/// As calibrate writes it after sessions whose biases differ by `sigma_between`.
Robot calibrated_robot(double bias_rad_s, double sigma_between) {
  Robot robot = with_bias(robot_with_gyro(), bias_rad_s);
  CalibratedParameter bias;
  bias.name = "gyro.bias";
  bias.unit = "rad/s";
  bias.value = bias_rad_s;
  bias.sigma_between = sigma_between;
  bias.observable = true;
  robot.calibration = CalibrationRecord{};
  robot.calibration->parameters = {bias};
  robot.calibration->covariance = Eigen::MatrixXd::Constant(1, 1, sigma_between * sigma_between);
  return robot;
}

AlignedReadings readings_of_drive(SensedDrive& drive, const std::vector<Piece>& pieces) {
  AlignedReadings readings;
  readings.increments = Increments(drive.over(pieces));
  readings.bridged.assign(readings.increments.size(), false);
  return readings;
}

IntegratedOdometry learned(const AlignedReadings& readings, const Robot& robot) {
  return integrate(readings, robot, {.learn_gyro_bias = true});
}

Pose2 end_of(const std::vector<Piece>& pieces) {
  Pose2 pose;
  for (const Piece& piece : pieces)
    pose = pose * exp(Twist2{piece.forward_m_s * piece.duration_s, 0.0, piece.turn_rad_s * piece.duration_s});
  return pose;
}

double nees_at_end(const IntegratedOdometry& result, const Pose2& truth) {
  const Pose2& pose = result.trajectory.poses.back().pose;
  const Vector3 error(pose.x - truth.x, pose.y - truth.y, wrap_angle(pose.heading - truth.heading));
  return error.dot(result.trajectory.covariances.back().inverse() * error);
}

std::vector<Finding> problems_of(const IntegratedOdometry& result, FindingCode code) {
  std::vector<Finding> found;
  for (const Finding& problem : result.findings)
    if (problem.code == code) found.push_back(problem);
  return found;
}

// Three sessions agreed to 0.0003 rad/s; on the next day the bias is off by 0.005.
TEST(CalibratedBias, IsLearnedAtRestOnADayWhenItIsFarFromItsSessions) {
  const int seeds = test::trials(400);
  const Robot robot = calibrated_robot(0.012, 0.0003);
  const std::vector<Piece> pieces = {{3.0}, {20.0, 0.25, 0.1}, {20.0, 0.25, -0.1}, {2.0}};
  int inside = 0;
  double nees = 0.0;
  for (int seed = 0; seed < seeds; ++seed) {
    SensedDrive drive(with_bias(robot_with_gyro(), 0.017), kRate_hz, static_cast<std::uint64_t>(seed));
    const IntegratedOdometry result = learned(readings_of_drive(drive, pieces), robot);
    ASSERT_GT(result.rest_s, 3.0) << seed;
    EXPECT_TRUE(problems_of(result, FindingCode::gyro_beyond_its_bias).empty()) << seed;
    const GyroBias bias = result.end_gyro_bias;
    inside += std::abs(bias.rad_s - drive.bias_rad_s()) <= 1.959964 * std::sqrt(bias.variance) ? 1 : 0;
    nees += nees_at_end(result, end_of(pieces)) / seeds;
  }
  const double share = static_cast<double>(inside) / seeds;
  EXPECT_NEAR(share, 0.95, 3.0 * std::sqrt(0.95 * 0.05 / seeds));
  // Each has a mean of 3 and a variance of 6, and less where wheels are better than the robot file says.
  EXPECT_LT(nees, 3.0 + 3.0 * std::sqrt(6.0 / seeds));
  RecordProperty("share", std::to_string(share));
  RecordProperty("nees", std::to_string(nees));
}

TEST(CalibratedBias, ARestThatTheGyroAloneRefusesIsSaid) {
  Gyro sure = test::kGyro;
  sure.bias_sigma_rad_s = 3e-4;
  const Robot robot = robot_with_gyro(sure);
  SensedDrive drive(with_bias(robot, 0.005), kRate_hz, 1);
  const IntegratedOdometry result =
      learned(readings_of_drive(drive, {{5.0, 0.2, 0.1}, {10.0}, {5.0, 0.2, 0.1}}), robot);
  EXPECT_EQ(result.rest_s, 0.0);
  const auto found = problems_of(result, FindingCode::gyro_beyond_its_bias);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(describe(found[0]), HasSubstr("no wheel turns for"));
  EXPECT_THAT(describe(found[0]), HasSubstr("raise bias_sigma_rad_s"));
  EXPECT_NEAR(std::stod(found[0].place), 5.0, 1.0);
}

TEST(CalibratedBias, ATurntableUnderStillWheelsIsSaid) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.01), kRate_hz, 2);
  drive.encoder_gain[0] = drive.encoder_gain[1] = 0.0;
  const auto found =
      problems_of(learned(readings_of_drive(drive, {{10.0}, {20.0, 0.0, 0.1}, {10.0}}), robot_with_gyro()),
                  FindingCode::gyro_beyond_its_bias);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(std::stod(found[0].place), 10.0, 1.0);
}

TEST(CalibratedBias, NothingIsSaidOfDrivingStandingAndTurning) {
  const int seeds = test::trials(200);
  for (int seed = 0; seed < seeds; ++seed) {
    SensedDrive drive(with_bias(robot_with_gyro(), 0.02), kRate_hz, static_cast<std::uint64_t>(seed));
    const AlignedReadings readings = readings_of_drive(drive, {{5.0},
                                                               {10.0, 0.25, 0.0},
                                                               {4.0, 0.0, 0.5},
                                                               {3.0},
                                                               {10.0, 0.0, 0.01},
                                                               {10.0, 0.005, 0.002},
                                                               {5.0, -0.25, 0.3},
                                                               {20.0}});
    EXPECT_TRUE(problems_of(learned(readings, robot_with_gyro()), FindingCode::gyro_beyond_its_bias).empty())
        << seed;
  }
}

}  // namespace
}  // namespace trundle::odometry
