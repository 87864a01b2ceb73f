#include "trundle/calibration/likelihood/errors_in_variables.hpp"

#include <cmath>
#include <optional>

#include <gtest/gtest.h>

namespace trundle::calibration::errors_in_variables_test {
namespace {

constexpr double kStep_s = 0.02, kWheelbase_m = 0.6, kSteering_rad = 0.4, kTurnsPerStep = 0.012;

Robot tricycle_with_gyro() {
  Robot robot;
  robot.wheel_names = {"front"};
  robot.passive_names = {"rear"};
  robot.chassis = tricycle({0.2, 2048.0, 0}, kWheelbase_m, {.sigma_rad = 0.009});
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4};
  return robot;
}

/// What noise in sensitivities makes of the information that a pose has, after two seconds of a turn; with
/// a rest of a second in the middle, its wheel nearly straight, at which the gyro reads `rest_rad` in each
/// row.
Eigen::MatrixXd noise_after_turn(std::optional<double> rest_rad) {
  const Robot robot = tricycle_with_gyro();
  const std::vector<Parameter> parameters = {*parameter_named("front.steering_scale", robot),
                                             *parameter_named("front.x", robot)};
  odometry::Odometer odometer(robot, {.parameters = parameters});
  SensitivityErrors errors(robot, parameters, odometer.pose(), robot.chassis, true);
  const auto step = [&](double turned, double steering_rad, double gyro_rad) {
    Increment increment;
    increment.duration_s = kStep_s;
    increment.turned[0] = turned;
    increment.steering_rad[0] = steering_rad;
    increment.has_gyro = true;
    increment.gyro_rad = gyro_rad;
    odometer.step(increment);
    errors.propagate(increment, odometer.pose());
  };
  const double turn_rad = kPi * 0.2 * kTurnsPerStep * std::sin(kSteering_rad) / kWheelbase_m;
  for (int i = 0; i < 50; ++i) step(kTurnsPerStep, kSteering_rad, turn_rad);
  for (int i = 0; rest_rad && i < 50; ++i) step(0.0, 1e-5, *rest_rad);
  for (int i = 0; i < 50; ++i) step(kTurnsPerStep, kSteering_rad, turn_rad);
  (void)errors.correction(Vector3::Zero(), odometer.pose());
  return errors.noise_in_information(Matrix3::Identity());
}

// That the robot turns a little by the gyro while its wheels stand says nothing of the angle at which they
// stand: of a wheel that points nearly ahead that turn is no way at all, and the noise of an angle is over
// it.
TEST(ErrorsInVariables, RestAddsNoNoise) {
  const Eigen::MatrixXd without = noise_after_turn(std::nullopt);
  ASSERT_GT(without.diagonal().minCoeff(), 0.0);
  for (const double rest_rad : {3e-8, 3e-6, 3e-4}) {
    const Eigen::MatrixXd with = noise_after_turn(rest_rad);
    EXPECT_LT((with - without).norm(), 0.05 * without.norm()) << rest_rad;
  }
}

}  // namespace
}  // namespace trundle::calibration::errors_in_variables_test
