#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/random.hpp"

#include "increments.hpp"
#include "scale.hpp"

namespace trundle::odometry {
namespace {

Matrix3 some_covariance() {
  return (Matrix3() << 0.04, 0.01, -0.002, 0.01, 0.09, 0.003, -0.002, 0.003, 0.01).finished();
}

Robot without_bias_walk(const Chassis& chassis) {
  Robot robot = test::robot_of(chassis);
  if (robot.chassis.gyro) robot.chassis.gyro->bias_walk_rad_s_sqrt_s = 0.0;
  return robot;
}

TEST(Covariance, AgreesWithTheDefinition) {
  for (const Chassis& chassis :
       {differential_drive(test::kSize, 0.5), omni3(test::kSize, 0.2), mecanum(test::kSize, 0.4, 0.5),
        test::two_pods(), test::odd_chassis(), tricycle(test::kSize, 0.6),
        ackermann(test::kSize, 0.4, 0.6, 0.3), swerve(test::kSize, 0.4, 0.5), test::odd_steered_chassis(),
        test::with_gyro(ackermann(test::kSize, 0.4, 0.6))}) {
    const Robot robot = without_bias_walk(chassis);
    const Pose2 start{0.5, -0.3, 0.8};
    Odometer odometer(robot, {.start = start, .start_covariance = some_covariance()});
    test::PlainOdometry plain(robot, robot.chassis, start);
    plain.start_with(body_covariance(start, some_covariance()));
    for (const Increment& increment : test::slipping(test::wandering(robot, test::kSanitizers ? 30 : 300))) {
      odometer.step(increment);
      plain.step(increment);
    }
    const Matrix3 expected = plain.covariance();
    EXPECT_LT((odometer.white_covariance() - expected).norm(), 1e-7 * expected.norm());
  }
}

/// One drive read at other rates: the counts are the same at its end, and so is what their rounding does.
TEST(Covariance, OfRoundingDoesNotDependOnTheRate) {
  const Robot robot =
      test::robot_of(differential_drive({.diameter_m = 0.1, .ticks_per_revolution = 100}, 0.3));
  const auto sigmas = [&](int per_second) {
    Odometer odometer(robot, {});
    Increment increment{.duration_s = 1.0 / per_second};
    double counts = 0.0;
    for (int i = 1; i <= 20 * per_second; ++i) {
      const double now = std::round(100.0 * i / per_second);  // one turn a second
      increment.turned[0] = increment.turned[1] = (now - counts) / 100.0;
      counts = now;
      odometer.step(increment);
    }
    return Vector3(odometer.white_covariance().diagonal().cwiseSqrt());
  };
  const Vector3 slow = sigmas(10);
  for (const int per_second : {50, 200, 1000})
    EXPECT_LT((sigmas(per_second) - slow).norm(), 0.01 * slow.norm());
  const double q = kPi * 0.1 / 100.0;
  const double rolled = 0.01 * 0.01 * 20.0 * kPi * 0.1 / 2.0;
  EXPECT_NEAR(slow.x() * slow.x(), rolled + 2.0 * q * q / 12.0 / 2.0, 0.01 * rolled);
}

/// Draws z with the readings' own noise, many times, and compares the scatter of the end pose.
TEST(Covariance, AgreesWithMonteCarlo) {
  const Robot robot =
      test::robot_of(differential_drive({.diameter_m = 0.15, .ticks_per_revolution = 0}, 0.5));
  const auto increments = test::wandering(robot, 50);
  Odometer odometer(robot, {});
  for (const Increment& increment : increments) odometer.step(increment);
  const int runs = test::trials(4000, 400);
  Random random(7);
  Matrix3 scatter = Matrix3::Zero();
  for (int run = 0; run < runs; ++run) {
    Pose2 pose;
    for (const Increment& increment : increments) {
      const Rows rows = rows_of(robot.chassis, false);
      Readings readings = readings_of(robot.chassis, rows, increment);
      for (int i = 0; i < rows.count(); ++i) readings.z[i] += random.normal(std::sqrt(readings.variance[i]));
      pose = pose * exp(estimate_twist(rows, readings).twist);
    }
    const Vector3 error(pose.x - odometer.pose().x, pose.y - odometer.pose().y,
                        pose.heading - odometer.pose().heading);
    scatter += error * error.transpose() / runs;
  }
  // Whitened, the sample covariance is 1 within √(2/n) per entry; 4.5 of that for six entries, and 2 % for
  // curvature.
  const Matrix3 L = odometer.white_covariance().llt().matrixL();
  const Matrix3 whitened = L.inverse() * scatter * L.inverse().transpose();
  EXPECT_LT((whitened - Matrix3::Identity()).cwiseAbs().maxCoeff(), 4.5 * std::sqrt(2.0 / runs) + 0.02);
}

/// A steering that is misread anew in each interval, many times, and the scatter of the end pose.
TEST(Covariance, OfMisreadSteeringAgreesWithMonteCarlo) {
  constexpr double kSigma = 0.02;
  Robot robot = test::robot_of(
      tricycle({.diameter_m = 0.15, .ticks_per_revolution = 0}, 0.6, SteeringSensor{.sigma_rad = kSigma}));
  robot.chassis.noise = {.wheel_per_sqrt_m = 1e-6, .lateral_per_sqrt_m = 1e-6};
  const auto increments = test::wandering(robot, 50);
  Odometer odometer(robot, {});
  for (const Increment& increment : increments) odometer.step(increment);
  const int runs = test::trials(4000, 400);
  Random random(8);
  Matrix3 scatter = Matrix3::Zero();
  for (int run = 0; run < runs; ++run) {
    Odometer misread(robot, {.with_covariance = false});
    for (Increment increment : increments) {
      increment.steering_rad[0] += random.normal(kSigma);
      misread.step(increment);
    }
    const Vector3 error(misread.pose().x - odometer.pose().x, misread.pose().y - odometer.pose().y,
                        misread.pose().heading - odometer.pose().heading);
    scatter += error * error.transpose() / runs;
  }
  const Matrix3 L = odometer.white_covariance().llt().matrixL();
  const Matrix3 whitened = L.inverse() * scatter * L.inverse().transpose();
  EXPECT_LT((whitened - Matrix3::Identity()).cwiseAbs().maxCoeff(), 4.5 * std::sqrt(2.0 / runs) + 0.02);
}

/// Noise within H biases least squares: as little of the way as the misread angles' cosines take.
TEST(Covariance, MisreadSteeringHardlyShortensTheWay) {
  constexpr double kSigma = 0.0087;
  constexpr int kSteps = 40'000;
  const SteeringSensor steering{.sigma_rad = kSigma};
  for (const Chassis& chassis :
       {tricycle(test::kSize, 0.6, steering), swerve(test::kSize, 0.4, 0.5, steering),
        ackermann(test::kSize, 0.4, 0.6, 0.0, steering)}) {
    Random random(9);
    const Robot robot = test::robot_of(chassis);
    const Rows rows = rows_of(chassis, false);
    double way_m = 0.0;
    for (int i = 0; i < kSteps; ++i) {
      Increment increment = test::steered_increment_of(chassis, {0.02, 0.0, 0.0});
      for (std::size_t k = 0; k < chassis.all_wheels().size(); ++k)
        increment.steering_rad[k] += random.normal(kSigma);
      way_m += twist_of(chassis, rows, increment).dx;
    }
    // Up to σ², and of a mean of squares 4 of its sigmas.
    EXPECT_NEAR(way_m / (0.02 * kSteps), 1.0, kSigma * kSigma * (1.0 + 4.0 * std::sqrt(2.0 / kSteps)));
  }
}

TEST(Covariance, OfTheWalkOfTheBias) {
  // Standing still with a gyro whose bias walks: the heading's variance is q² Σ (t_end − t_k)² dt, in steps.
  Robot robot = test::robot_of(test::two_pods());
  robot.chassis.gyro->noise_rad_s_sqrt_hz = 0.0;
  robot.chassis.gyro->bias_walk_rad_s_sqrt_s = 0.01;
  Odometer odometer(robot, {});
  const Increment still{.duration_s = 0.1, .has_gyro = true};
  double expected = 0.0;
  for (int i = 0; i < 100; ++i) odometer.step(still);
  for (int k = 0; k < 100; ++k) expected += 1e-4 * 0.1 * std::pow(0.1 * k, 2);
  EXPECT_NEAR(odometer.white_covariance()(2, 2), expected, 1e-9);
}

TEST(Covariance, GrowsByWhatAGapHides) {
  const Robot robot = test::differential_robot(0.5);
  Odometer through(robot, {});
  Odometer across(robot, {});
  through.step(test::two_wheels(0.9, 1.1));
  across.step_across_gap(test::two_wheels(0.9, 1.1));
  EXPECT_EQ(across.pose().x, through.pose().x);
  const double sigma = 1.0 * (0.4 + 0.1) / std::sqrt(12.0);
  const Matrix3 added = across.white_covariance() - through.white_covariance();
  EXPECT_NEAR(added(0, 0), sigma * sigma, 1e-12);
  EXPECT_NEAR(added(1, 1), sigma * sigma, 1e-12);
  EXPECT_EQ(added(2, 2), 0.0);
}

TEST(Covariance, GrowsByTheTurnThatAGapHidesOfASteeredRobot) {
  const Robot robot = test::robot_of(tricycle(test::kSize, 0.6));
  Odometer through(robot, {});
  Odometer across(robot, {});
  const Increment increment{.duration_s = 4.0, .turned = {2.0}, .steering_rad = {0.1}};
  through.step(increment);
  across.step_across_gap(increment);
  EXPECT_NEAR(across.white_covariance()(2, 2) - through.white_covariance()(2, 2), 0.25 * 4.0, 1e-12);
}

}  // namespace
}  // namespace trundle::odometry
