#include "trundle/calibration/likelihood/own_sensitivity.hpp"

#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "trundle/calibration/likelihood/run_likelihood.hpp"

#include "calibration/simulated_runs.hpp"

namespace trundle::calibration {
namespace {

constexpr double kStart_rad = 0.05;  // from where odometry begins, which is off

/// A run whose reference sits beside the middle of the body, and shows no headings.
Run run_of_positions(const Robot& robot) {
  Run run = test::prepared(robot, robot, test::differential_paths(), 4).front();
  for (double& heading_rad : run.reference.heading_rad) heading_rad = kNotMeasured;
  run.start_heading_rad = kStart_rad;
  return run;
}

Robot robot_beside_its_reference(double wheel_noise) {
  Robot robot = test::true_differential();
  robot.body_from_reference = {0.3, 0.2, 0.1};
  robot.chassis.noise.wheel_per_sqrt_m = robot.chassis.noise.lateral_per_sqrt_m = wheel_noise;
  return robot;
}

Information with_start_heading(const Run& run, const Robot& robot) {
  return stream_likelihood(run, robot, {},
                           {.reference_noise = {.position_m = test::kPositionSigma_m}, .own = {{}, true}})
      .total();
}

/// With hardly any noise of the wheels nothing corrects the path, and what weighs residuals depends on
/// nothing: the gradient is that of χ²/2. With some, the path is corrected all along, and the weights turn a
/// little.
TEST(OwnSensitivity, OfTheStartHeadingIsTheSlopeOfTheSquares) {
  for (const auto& [noise, share] : {std::array{1e-6, 1e-3}, std::array{0.003, 0.03}}) {
    const Robot robot = robot_beside_its_reference(noise);
    calibration::Run run = run_of_positions(robot);
    constexpr double kStep = 1e-5;
    run.start_heading_rad = kStart_rad + kStep;
    const double after = with_start_heading(run, robot).chi2;
    run.start_heading_rad = kStart_rad - kStep;
    const double before = with_start_heading(run, robot).chi2;
    run.start_heading_rad = kStart_rad;
    const Information information = with_start_heading(run, robot);
    ASSERT_EQ(information.gradient.size(), 1);
    const double slope = -0.5 * (after - before) / (2.0 * kStep);
    EXPECT_NEAR(information.gradient[0], slope, share * std::abs(slope)) << noise;
  }
}

/// Where the run begins with headings that are known, the best heading of its own is that one.
TEST(OwnSensitivity, LeadsToTheStartHeading) {
  const Robot robot = robot_beside_its_reference(0.003);
  calibration::Run run = run_of_positions(robot);
  double step = 1.0, sigma = 0.0;
  for (int i = 0; i < 8; ++i) {
    const Information information = with_start_heading(run, robot);
    step = information.gradient[0] / information.matrix(0, 0);
    sigma = 1.0 / std::sqrt(information.matrix(0, 0));
    *run.start_heading_rad += step;
  }
  EXPECT_LT(std::abs(step), 1e-3 * sigma);
  EXPECT_LT(std::abs(*run.start_heading_rad), 4.0 * sigma);
  EXPECT_LT(sigma, 0.01);
}

}  // namespace
}  // namespace trundle::calibration
