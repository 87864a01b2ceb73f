#include "trundle/calibration/validation/conclusion.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

constexpr Parameter kDirection{ParameterKind::direction, 0};

/// Of the direction of one wheel, by so much from nominal [rad].
Estimate estimate_of(double off_rad, const Robot& nominal) {
  Estimate estimate;
  estimate.robot = nominal;
  set_value(kDirection, off_rad, estimate.robot);
  estimate.space.scale = estimate.space.sigma_data = Eigen::VectorXd::Constant(1, 0.17);
  estimate.space.basis = Eigen::MatrixXd::Identity(1, 1);
  estimate.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-6);
  estimate.held_covariance = Eigen::MatrixXd::Zero(1, 1);
  estimate.descent = {.converged = true, .parameter = 0};
  return estimate;
}

Robot omni_robot() {
  Robot robot;
  robot.chassis = omni3({0.1, 0.0}, 0.2);
  robot.wheel_names = {"a", "b", "c"};
  set_value(kDirection, 0.0, robot);
  return robot;
}

TEST(Conclusion, ADirectionThatWentAroundIsToldNearWhereItWasGiven) {
  const Robot nominal = omni_robot();
  const CalibrationResult result =
      result_of(estimate_of(2.0 * kPi + 0.01, nominal), {}, {&kDirection, 1}, nominal);
  EXPECT_NEAR(result.parameters.front().value, 0.01, 1e-12);
  EXPECT_NEAR(value_of(kDirection, result.calibrated), 0.01, 1e-12);
}

TEST(Conclusion, ASearchThatMovesByMoreThanItsSigmasHasFoundNothing) {
  const Robot nominal = omni_robot();
  Estimate estimate = estimate_of(0.01, nominal);
  estimate.descent.converged = false;
  estimate.descent.last_step = 10.0;
  EXPECT_THROW((void)result_of(estimate, {}, {&kDirection, 1}, nominal), CannotAnswer);
  estimate.descent.last_step = 0.5;
  EXPECT_THAT(result_of(estimate, {}, {&kDirection, 1}, nominal).warnings, testing::SizeIs(1));
}

}  // namespace
}  // namespace trundle::calibration
