#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/odometry/integrate.hpp"
#include "trundle/simulation/scenario.hpp"

#include "increments.hpp"
#include "scale.hpp"

namespace trundle {
namespace {

/// eᵀ Σ⁻¹ e of the end pose.
double nees_of(const Pose2& estimate, const Pose2& truth, const Matrix3& covariance) {
  const Vector3 error(estimate.x - truth.x, estimate.y - truth.y, estimate.heading - truth.heading);
  return error.dot(covariance.llt().solve(error));
}

Robot robot_with_noise(Chassis chassis) {
  for (Wheel& wheel : chassis.wheels()) wheel.ticks_per_revolution = 1e6;
  chassis.noise.wheel_per_sqrt_m = 0.004;
  chassis.noise.lateral_per_sqrt_m = 0.002;
  return test::robot_of(chassis);
}

Scenario tour_of(const Robot& estimated, const Robot& truth, std::uint64_t seed, bool sideways) {
  Scenario scenario;
  scenario.nominal = estimated;
  scenario.truth = truth;
  Random random(seed, 99);
  scenario.path = random_tour({.length_m = 6.0, .pause_share = 0.0, .sideways = sideways}, {}, random);
  scenario.encoders = {.rate_hz = 10.0, .unit = WheelUnit::ticks, .quantised = false, .wrapped = false};
  scenario.seed = seed;
  return scenario;
}

/// Mean NEES of the end pose over seeded tours; `draw` makes the true robot from the one odometry believes
/// in.
template <typename Draw>
double mean_nees(const Robot& estimated, int runs, bool sideways, Draw draw) {
  double sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    const auto seed = static_cast<std::uint64_t>(run + 1);
    const Simulation simulation = simulate(tour_of(estimated, draw(seed), seed, sideways));
    const IntegratedOdometry odometry = integrate(simulation.recording, estimated);
    sum += nees_of(odometry.trajectory.poses.back().pose, simulation.truth.body.poses.back().pose,
                   odometry.trajectory.covariances.back());
  }
  return sum / runs;
}

/// 99.9 % of the means of n draws of χ² with 3 degrees of freedom lie within 3 ± this.
double band(int runs) {
  return 3.29 * std::sqrt(6.0 / runs);
}

TEST(Nees, OfTheWhitePart) {
  const int runs = test::trials(1000, 100);
  for (const bool sideways : {false, true}) {
    const Robot robot =
        robot_with_noise(sideways ? omni3(test::kSize, 0.2) : differential_drive(test::kSize, 0.5));
    const double nees = mean_nees(robot, runs, sideways, [&](std::uint64_t) { return robot; });
    EXPECT_NEAR(nees, 3.0, band(runs));
  }
}

TEST(Nees, OfBothPartsWithParametersDrawnFromTheirCovariance) {
  const int runs = test::trials(1000, 100);
  Robot robot = robot_with_noise(differential_drive(test::kSize, 0.5));
  const std::vector<Parameter> parameters = {
      {ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}, {ParameterKind::track, -1}};
  // 0.15 % of each diameter, half of it common to both; 0.5 % of the track: headings stay within a few
  // degrees, where linear propagation holds.
  const double d = 0.0015 * test::kSize.diameter_m;
  Matrix3 covariance = Matrix3::Zero();
  covariance.diagonal() << d * d, d * d, 0.0025 * 0.0025;
  covariance(0, 1) = covariance(1, 0) = 0.5 * d * d;
  robot.calibration = test::calibrated({"w0.diameter", "w1.diameter", "track"}, covariance);
  const Matrix3 L = covariance.llt().matrixL();
  const auto drawn = [&](std::uint64_t seed) {
    Random random(seed, 100);
    const Vector3 error = L * Vector3(random.normal(), random.normal(), random.normal());
    Robot truth = robot;
    for (int j = 0; j < 3; ++j) {
      const Parameter& parameter = parameters[static_cast<std::size_t>(j)];
      set_value(parameter, value_of(parameter, robot) + error[j], truth);
    }
    return truth;
  };
  EXPECT_NEAR(mean_nees(robot, runs, false, drawn), 3.0, band(runs));
  Robot overconfident = robot;
  overconfident.calibration.reset();
  EXPECT_GT(mean_nees(overconfident, runs, false, drawn), 3.0 + 2.0 * band(runs));
}

}  // namespace
}  // namespace trundle
