#include <gtest/gtest.h>

#include "trundle/odometry/integrate.hpp"

#include "increments.hpp"
#include "scale.hpp"

namespace trundle::odometry {
namespace {

Vector3 vector_of(const Pose2& pose) {
  return {pose.x, pose.y, pose.heading};
}

/// Readings with the gyro's stamps moved by so much.
std::vector<Increment> with_clock(std::vector<Increment> increments, double shift_s) {
  for (Increment& increment : increments) increment.gyro_rad -= shift_s * increment.gyro_change_rad_s;
  return increments;
}

/// ∂(end pose)/∂p by central differences of the whole integration, weights held at the nominal robot's.
Vector3 numeric_sensitivity(const Parameter& parameter, const Robot& robot,
                            const std::vector<Increment>& increments) {
  const double value = value_of(parameter, robot);
  const double step = 1e-5 * std::max(0.1, std::abs(value));
  Robot more = robot;
  Robot less = robot;
  set_value(parameter, value + step, more);
  set_value(parameter, value - step, less);
  const double shift_s = parameter.kind == ParameterKind::gyro_time_offset ? step : 0.0;
  return (vector_of(test::plainly_integrated(more, robot.chassis, with_clock(increments, shift_s))) -
          vector_of(test::plainly_integrated(less, robot.chassis, with_clock(increments, -shift_s)))) /
         (2.0 * step);
}

void expect_sensitivities(const Chassis& chassis) {
  const Robot robot = test::robot_of(chassis);
  const auto increments = test::wandering(robot, test::kSanitizers ? 10 : 200);
  const std::vector<Parameter> parameters = parameters_of(robot);
  Odometer odometer(robot, {.parameters = parameters});
  for (const Increment& increment : increments) odometer.step(increment);
  const PoseSensitivity J = odometer.sensitivity();
  ASSERT_EQ(J.cols(), static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const Vector3 expected = numeric_sensitivity(parameters[j], robot, increments);
    const Vector3 actual = J.col(static_cast<Eigen::Index>(j));
    EXPECT_LT((actual - expected).norm(), 1e-6 * (1.0 + expected.norm())) << name_of(parameters[j], robot);
  }
}

TEST(Sensitivity, Differential) {
  expect_sensitivities(differential_drive(test::kSize, 0.5));
}
TEST(Sensitivity, DifferentialWithGyro) {
  expect_sensitivities(test::with_gyro(differential_drive(test::kSize, 0.5)));
}
TEST(Sensitivity, SkidSteer) {
  expect_sensitivities(skid_steer(test::kSize, 0.7, 0.4));
}
TEST(Sensitivity, SkidSteerThatScrubs) {
  expect_sensitivities(test::scrubbing());
  expect_sensitivities(test::with_gyro(test::scrubbing()));
}
TEST(Sensitivity, TyresThatGrow) {
  expect_sensitivities(test::growing(differential_drive(test::kSize, 0.5)));
  expect_sensitivities(test::growing(test::scrubbing()));
  expect_sensitivities(test::growing(test::odd_chassis()));
}
TEST(Sensitivity, Omni3) {
  expect_sensitivities(omni3(test::kSize, 0.2));
}
TEST(Sensitivity, Mecanum) {
  expect_sensitivities(mecanum(test::kSize, 0.4, 0.5));
}
TEST(Sensitivity, PodsAndGyro) {
  expect_sensitivities(test::two_pods());
}
TEST(Sensitivity, AllKindsOfWheel) {
  expect_sensitivities(test::odd_chassis());
}

TEST(Sensitivity, Velocity) {
  Chassis chassis = test::velocity_robot();
  expect_sensitivities(chassis);
  chassis.gyro.reset();
  expect_sensitivities(chassis);
}

TEST(Sensitivity, Tricycle) {
  expect_sensitivities(tricycle(test::kSize, 0.6, test::kSteering));
}
TEST(Sensitivity, Ackermann) {
  expect_sensitivities(ackermann(test::kSize, 0.4, 0.6, 0.3, test::kSteering));
}
TEST(Sensitivity, Swerve) {
  expect_sensitivities(swerve(test::kSize, 0.4, 0.5, test::kSteering));
}
TEST(Sensitivity, SteeredWheelsAtOddPlacesWithGyro) {
  expect_sensitivities(test::with_gyro(test::odd_steered_chassis()));
}

TEST(Sensitivity, MakesTheSecondPartOfTheCovariance) {
  Robot robot = test::differential_robot();
  const auto increments = test::wandering(robot, 100);
  const std::vector<Parameter> parameters = {{ParameterKind::diameter, 1}, {ParameterKind::track, -1}};
  const Matrix2 covariance = (Matrix2() << 1e-6, 2e-7, 2e-7, 4e-6).finished();
  Matrix3 with_exact = Matrix3::Zero();  // a diameter that stays as given and is not in doubt
  with_exact.bottomRightCorner<2, 2>() = covariance;
  robot.calibration = test::calibrated({"w0.diameter", "w1.diameter", "track"}, with_exact);
  robot.calibration->parameters.front().observable = false;

  const IntegratedOdometry result = integrate(test::aligned(increments), robot);
  Odometer odometer(robot, {.parameters = parameters});
  for (const Increment& increment : increments) odometer.step(increment);
  const PoseSensitivity J = odometer.sensitivity();
  const Matrix3 expected = J * covariance * J.transpose();
  EXPECT_LT((result.end_parameter_covariance - expected).norm(), 1e-15);
  EXPECT_LT((result.trajectory.covariances.back() - result.end_white_covariance - expected).norm(), 1e-12);
  EXPECT_EQ(result.parameters, (std::vector<std::string>{"w1.diameter", "track"}));
}

}  // namespace
}  // namespace trundle::odometry
