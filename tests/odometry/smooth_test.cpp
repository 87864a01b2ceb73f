#include "trundle/odometry/smooth.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "trundle/odometry/integrate.hpp"

#include "increments.hpp"
#include "scale.hpp"
#include "sensed_drive.hpp"

namespace trundle::odometry {
namespace {

using test::Piece;
using test::robot_with_gyro;
using test::SensedDrive;
using test::with_bias;

using Vector4 = Eigen::Vector4d;
using Matrix4 = Eigen::Matrix4d;

const std::vector<Piece> kTour = {{5.0}, {8.0, 0.3, 0.1},   {4.0, 0.2, -0.6},
                                  {3.0}, {10.0, 0.3, 0.05}, {3.0, 0.1, 0.8},
                                  {4.0}, {6.0, 0.25, -0.2}};

std::vector<FilteredStep> filtered(const Robot& robot, const std::vector<Increment>& increments,
                                   double bias_rad_s = 0.0) {
  Odometer odometer(
      robot,
      {.start_covariance = 1e-4 * Matrix3::Identity(), .learn_gyro_bias = true, .compare_turns = false});
  OdometerState state = odometer.state();
  state.bias_rad_s = bias_rad_s;
  odometer.resume(state);
  std::vector<FilteredStep> steps = {filtered_step(odometer)};
  for (const Increment& increment : increments) {
    odometer.step(increment);
    steps.push_back(filtered_step(odometer));
  }
  return steps;
}

Matrix4 covariance_of(const FilteredStep& step) {
  Matrix4 P;
  P << full_matrix(step.white), Eigen::Map<const Vector3>(step.bias.data()),
      Eigen::Map<const Vector3>(step.bias.data()).transpose(), step.gyro_bias.variance;
  return P;
}

Vector4 mean_of(const FilteredStep& step) {
  return {step.pose.x, step.pose.y, step.pose.heading, step.gyro_bias.rad_s};
}

struct Gaussian4 {
  Vector4 mean;
  Matrix4 covariance;
};

/// Rauch, Tung and Striebel's recursion with inverses of the predicted covariances, as books print it.
std::vector<Gaussian4> rauch_tung_striebel(const std::vector<FilteredStep>& steps) {
  std::vector<Gaussian4> smoothed(steps.size());
  smoothed.back() = {mean_of(steps.back()), covariance_of(steps.back())};
  for (std::size_t k = steps.size() - 1; k-- > 0;) {
    const StepTrace& trace = steps[k + 1].trace;
    Matrix4 A = Matrix4::Identity();
    A(0, 2) = -trace.displacement[1];
    A(1, 2) = trace.displacement[0];
    A.topRightCorner<3, 1>() = Eigen::Map<const Vector3>(trace.by_bias.data());
    // Before the update of step k + 1: the update taken back.
    const Vector4 K = Eigen::Map<const Vector4>(trace.gain.data());
    const Vector4 predicted_mean = mean_of(steps[k + 1]) - K * trace.innovation;
    const Matrix4 predicted = covariance_of(steps[k + 1]) + trace.innovation_variance * K * K.transpose();
    const Matrix4 P = covariance_of(steps[k]);
    const Matrix4 C = P * A.transpose() * predicted.inverse();
    smoothed[k] = {mean_of(steps[k]) + C * (smoothed[k + 1].mean - predicted_mean),
                   P + C * (smoothed[k + 1].covariance - predicted) * C.transpose()};
  }
  return smoothed;
}

TEST(Smooth, AgreesWithTheTextbook) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.02), 10.0, 1);
  std::vector<FilteredStep> steps = filtered(robot_with_gyro(), drive.over(kTour));
  const std::vector<Gaussian4> expected = rauch_tung_striebel(steps);
  smooth(steps, 0.0);
  EXPECT_EQ(mean_of(steps.back()), expected.back().mean);  // the last one stays, to the bit
  EXPECT_EQ(covariance_of(steps.back()), expected.back().covariance);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const Vector4 sigma = expected[k].covariance.diagonal().cwiseSqrt();
    EXPECT_LT((mean_of(steps[k]) - expected[k].mean).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 1e-5) << k;
    EXPECT_LT((covariance_of(steps[k]) - expected[k].covariance)
                  .cwiseQuotient(sigma * sigma.transpose())
                  .cwiseAbs()
                  .maxCoeff(),
              1e-5)
        << k;
  }
}

// Of a robot whose wheels do not show the turn: they would teach the filter, and not the smoother.
TEST(Smooth, TheEndStays) {
  Robot robot = robot_with_gyro();
  robot.chassis = test::two_pods();
  SensedDrive drive(with_bias(robot, 0.02), 10.0, 2);
  const AlignedReadings readings = test::aligned(drive.over(kTour));
  const IntegratedOdometry filter = integrate(readings, robot);
  const IntegratedOdometry smoother = integrate(readings, robot, {.smooth = true});
  const Pose2& a = filter.trajectory.poses.back().pose;
  const Pose2& b = smoother.trajectory.poses.back().pose;
  const Matrix3& P = filter.trajectory.covariances.back();
  EXPECT_LT((a.translation() - b.translation()).norm(), 1e-3 * std::sqrt(P(0, 0)));
  EXPECT_NEAR(a.heading, b.heading, 1e-3 * std::sqrt(P(2, 2)));
  EXPECT_LT((P - smoother.trajectory.covariances.back()).norm(), 1e-3 * P.norm());
  EXPECT_NE(filter.trajectory.poses[200].pose.heading, smoother.trajectory.poses[200].pose.heading);
}

// Where all is small: about another bias, with the same one expected.
TEST(Smooth, WhereItIsLinearisedDoesNotMatter) {
  SensedDrive drive(with_bias(robot_with_gyro(), 1e-5), 10.0, 1);
  const std::vector<Increment> increments = drive.over(kTour);
  constexpr double kElsewhere_rad_s = 2e-5;
  std::vector<FilteredStep> expected = filtered(robot_with_gyro(), increments);
  std::vector<FilteredStep> steps = filtered(robot_with_gyro(), increments, kElsewhere_rad_s);
  smooth(expected, 0.0);
  smooth(steps, -kElsewhere_rad_s);
  for (std::size_t k = 0; k < steps.size(); ++k)
    EXPECT_LT((mean_of(steps[k]) - mean_of(expected[k])).cwiseAbs().maxCoeff(), 1e-8) << k;
}

// Until the first rest the heading goes round by 2 rad: turned back to first order, positions are metres off.
TEST(Smooth, PositionsBeforeTheFirstRestAreRight) {
  const std::vector<Piece> tour = {
      {15.0, 0.3, 0.2}, {10.0, 0.3, -0.4}, {15.0, 0.3, 0.1}, {5.0}, {10.0, 0.3, 0.3}, {5.0}};
  double squares = 0.0;
  int poses = 0;
  const int trials = test::trials(40, 8);
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(trials); ++seed) {
    Robot robot = robot_with_gyro();
    robot.chassis.gyro->bias_sigma_rad_s = 0.05;
    robot.chassis.noise.wheel_per_sqrt_m = 0.01;
    SensedDrive drive(with_bias(robot, 0.05), 20.0, seed);
    drive.wheel_noise_per_sqrt_m = 0.01;
    const IntegratedOdometry smoother = integrate(test::aligned(drive.over(tour)), robot, {.smooth = true});
    Pose2 truth;
    std::size_t k = 0;
    for (const Piece& piece : tour)
      for (int i = 0; i < static_cast<int>(std::lround(20.0 * piece.duration_s)); ++i) {
        truth = truth * exp(Twist2{piece.forward_m_s / 20.0, 0.0, piece.turn_rad_s / 20.0});
        ++k;
        if (k % 150 != 0) continue;
        const Vector2 error = smoother.trajectory.poses[k].pose.translation() - truth.translation();
        const Matrix2 P = smoother.trajectory.covariances[k].topLeftCorner<2, 2>();
        squares += error.dot(P.inverse() * error);
        ++poses;
      }
  }
  // Eight poses of a drive hang together: at most as if one were all of them.
  const double mean = squares / poses;
  EXPECT_GT(mean, 2.0 - 4.0 * 2.0 / std::sqrt(trials));
  EXPECT_LT(mean, 2.0 + 4.0 * 2.0 / std::sqrt(trials));
}

// Where the bias is learned, the pose jumps to where the robot has stood all along.
TEST(Odometry, WhatARestShowsIsNoWay) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.05), 20.0, 3);
  const AlignedReadings readings =
      test::aligned(drive.over({{15.0, 0.3, 0.2}, {10.0, 0.3, -0.4}, {15.0, 0.3, 0.1}, {5.0}}));
  const IntegratedOdometry filter = integrate(readings, robot_with_gyro());
  const IntegratedOdometry smoother = integrate(readings, robot_with_gyro(), {.smooth = true});
  EXPECT_NEAR(filter.path_length_m, 12.0, 0.05);
  EXPECT_NEAR(filter.path_length_m, smoother.path_length_m, 0.01);
}

}  // namespace
}  // namespace trundle::odometry
