#include <cstdio>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/simulation/scenario.hpp"

#include "increments.hpp"
#include "scale.hpp"

namespace trundle::odometry {
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

/// e = Log(T̂⁻¹ T), by the covariance in the estimate's own axes.
double nees_in_body(const Pose2& estimate, const Pose2& truth, const Matrix3& world_covariance) {
  const Vector3 error = log(estimate.inverse() * truth).vector();
  return error.dot(body_covariance(estimate, world_covariance).llt().solve(error));
}

/// Differential drive with a gyro of 100 Hz and 0.003 rad/s per sample whose bias is not known.
Robot robot_of_unknown_bias() {
  Robot robot = robot_with_noise(differential_drive(test::kSize, 0.5));
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4, .bias_walk_rad_s_sqrt_s = 1e-5};
  return robot;
}

/// 5 s of standing still, then a tour with stops.
Simulation tour_with_rests(const Robot& robot, std::uint64_t seed) {
  Random random(seed, 101);
  Robot truth = robot;
  truth.chassis.gyro->bias_rad_s = random.normal(robot.chassis.gyro->bias_sigma_rad_s);
  Scenario scenario = tour_of(robot, truth, seed, false);
  const Tour tour{.length_m = 10.0, .pause_share = 0.3};
  scenario.path = joined({pause(5.0), random_tour(tour, {}, random, {.rest_s = 2.0})});
  return simulate(scenario);
}

TEST(Nees, WithALearnedGyroBias) {
  const int runs = test::trials(1000, 100);
  const Robot robot = robot_of_unknown_bias();
  double sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    const Simulation simulation = tour_with_rests(robot, static_cast<std::uint64_t>(run + 1));
    const IntegratedOdometry odometry = integrate(simulation.recording, robot);
    EXPECT_GT(odometry.rest_s, 3.0);
    sum += nees_in_body(odometry.trajectory.poses.back().pose, simulation.truth.body.poses.back().pose,
                        odometry.trajectory.covariances.back());
  }
  std::printf("NEES at the end of %d runs: mean %.2f\n", runs, sum / runs);
  EXPECT_NEAR(sum / runs, 3.0, band(runs));
}

TEST(Nees, SmoothingIsHonestAndBeatsTheFilterInside) {
  const int runs = test::trials(500, 100);
  Robot robot = robot_of_unknown_bias();
  robot.chassis.gyro->noise_rad_s_sqrt_hz = 1e-3;
  robot.chassis.gyro->bias_walk_rad_s_sqrt_s = 3e-4;  // so that a later rest has something to say
  double nees = 0.0;
  double filter2 = 0.0;
  double smoother2 = 0.0;
  for (int run = 0; run < runs; ++run) {
    const Simulation simulation = tour_with_rests(robot, static_cast<std::uint64_t>(run + 1));
    const AlignedReadings readings = align(simulation.recording, robot);
    const Trajectory filter = integrate(readings, robot).trajectory;
    const Trajectory smoother = integrate(readings, robot, {.smooth = true}).trajectory;
    const std::size_t middle = filter.poses.size() / 2;
    const auto truth = pose_at(simulation.truth.body, filter.poses[middle].time_s, 1.0);
    ASSERT_TRUE(truth);
    nees += nees_in_body(smoother.poses[middle].pose, *truth, smoother.covariances[middle]);
    filter2 += std::pow(filter.poses[middle].pose.heading - truth->heading, 2);
    smoother2 += std::pow(smoother.poses[middle].pose.heading - truth->heading, 2);
  }
  RecordProperty("nees", std::to_string(nees / runs));
  RecordProperty("heading_rms_ratio", std::to_string(std::sqrt(smoother2 / filter2)));
  EXPECT_NEAR(nees / runs, 3.0, band(runs));
  EXPECT_LT(std::sqrt(smoother2 / filter2), 0.95);
}

}  // namespace
}  // namespace trundle::odometry
