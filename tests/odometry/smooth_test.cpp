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

std::vector<FilteredStep> filtered(const Robot& robot, const std::vector<Increment>& increments) {
  Odometer odometer(
      robot,
      {.start_covariance = 1e-4 * Matrix3::Identity(), .learn_gyro_bias = true, .compare_turns = false});
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
  smooth(steps);
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
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.heading, b.heading);
  EXPECT_EQ(filter.trajectory.covariances.back(), smoother.trajectory.covariances.back());
  EXPECT_NE(filter.trajectory.poses[200].pose.heading, smoother.trajectory.poses[200].pose.heading);
}

}  // namespace
}  // namespace trundle::odometry
