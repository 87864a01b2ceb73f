#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "chassis/robots.hpp"

namespace trundle::chassis {
namespace {

using test::increment_of;
using test::kSize;

std::vector<Chassis> every_chassis() {
  return {differential_drive(kSize, 0.4),
          test::with_gyro(differential_drive(kSize, 0.4)),
          test::with_gyro(skid_steer(kSize, 0.6, 0.5)),
          omni3(kSize, 0.2),
          mecanum(kSize, 0.3, 0.4),
          test::two_pods(),
          test::three_pods(),
          test::joined(omni3(kSize, 0.2), test::two_pods()),
          test::odd_chassis(),
          test::velocity_robot()};
}

Increment noisy_increment(const Chassis& chassis, std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  Increment increment = increment_of(chassis, {0.05, 0.0, 0.1});
  for (double& turned : increment.turned) turned += 0.01 * normal(engine);
  return increment;
}

TEST(EstimateTwist, is_the_weighted_least_squares_solution_of_a_generic_solver) {
  std::mt19937_64 engine(1);
  for (const Chassis& chassis : every_chassis()) {
    const Rows rows = rows_of(chassis, true);
    const Readings readings = readings_of(chassis, rows, noisy_increment(chassis, engine));
    const Eigen::VectorXd sigma = readings.variance.cwiseSqrt();
    const Eigen::MatrixXd A = sigma.cwiseInverse().asDiagonal() * Eigen::MatrixXd(rows.H);
    const Eigen::VectorXd b = readings.z.cwiseQuotient(readings.variance.cwiseSqrt());
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Vector3 generic = svd.solve(b);
    const Matrix3 information = A.transpose() * A;

    const TwistEstimate estimate = estimate_twist(rows, readings);
    EXPECT_LT((estimate.twist.vector() - generic).norm(), 1e-12);
    EXPECT_LT((information * estimate.covariance - Matrix3::Identity()).norm(), 1e-8);
  }
}

/// The part of a motion that no lateral row forbids.
Twist2 allowed(const Rows& rows, const Twist2& motion) {
  const Eigen::MatrixXd L = rows.H.bottomRows(rows.count() - rows.measured);
  if (L.rows() == 0) return motion;
  const Eigen::MatrixXd inverse = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(L).pseudoInverse();
  return Twist2::from(motion.vector() - inverse * (L * motion.vector()));
}

TEST(EstimateTwist, finds_the_motion_behind_perfect_readings) {
  for (const Chassis& chassis : every_chassis()) {
    const Rows rows = rows_of(chassis, true);
    const Twist2 motion = allowed(rows, {0.05, 0.02, 0.03});
    const TwistEstimate estimate =
        estimate_twist(rows, readings_of(chassis, rows, increment_of(chassis, motion)));
    EXPECT_LT((estimate.twist.vector() - motion.vector()).norm(), 1e-13);
  }
}

TEST(EstimateTwist, of_a_differential_drive_is_the_textbook_formula) {
  const Chassis chassis = differential_drive(kSize, 0.4);
  const Rows rows = rows_of(chassis, false);
  for (const auto& [left, right] : {std::pair{1.0, 1.0}, {0.3, -0.7}, {-2.0, 1.5}, {0.0, 0.01}, {0.0, 0.0}}) {
    Increment increment;
    increment.turned = {left, right};
    const double dl = kPi * 0.15 * left;
    const double dr = kPi * 0.15 * right;
    const Readings readings = readings_of(chassis, rows, increment);
    const TwistEstimate estimate = estimate_twist(rows, readings);
    EXPECT_NEAR(estimate.twist.dx, (dl + dr) / 2, 1e-15);
    EXPECT_EQ(estimate.twist.dy, 0.0);
    EXPECT_NEAR(estimate.twist.dtheta, (dr - dl) / 0.4, 1e-14);
    const double var_l = readings.variance[0];
    const double var_r = readings.variance[1];
    EXPECT_NEAR(estimate.covariance(0, 0), (var_l + var_r) / 4, 1e-12 * (var_l + var_r));
    EXPECT_NEAR(estimate.covariance(2, 2), (var_l + var_r) / 0.16, 1e-11 * (var_l + var_r));
    EXPECT_NEAR(estimate.covariance(0, 2), (var_r - var_l) / 0.8, 1e-11 * (var_l + var_r));
    EXPECT_NEAR(estimate.covariance(1, 1), readings.variance[2], 1e-13 * readings.variance[2]);
  }
}

TEST(EstimateTwist, four_fixed_wheels_forbid_a_turn_that_skid_wheels_allow) {
  Chassis skid = skid_steer(kSize, 0.6, 0.5);
  Chassis fixed = skid;
  for (Wheel& wheel : fixed.wheels()) wheel.kind = WheelKind::fixed;
  const Twist2 pivot{0.0, 0.0, 0.2};
  const auto estimated = [&](const Chassis& chassis) {
    const Rows rows = rows_of(chassis, false);
    return estimate_twist(rows, readings_of(chassis, rows, increment_of(chassis, pivot))).twist.dtheta;
  };
  EXPECT_NEAR(estimated(skid), 0.2, 1e-14);
  EXPECT_LT(estimated(fixed), 0.2 * 0.05);
}

TEST(EstimateTwist, of_a_skid_steer_moves_sideways_around_its_centre_of_rotation) {
  Chassis chassis = skid_steer(kSize, 0.6, 0.5);
  chassis.icr_x_m = 0.03;
  const Rows rows = rows_of(chassis, false);
  const Twist2 motion{0.1, 0.03 * 0.2, 0.2};
  const double still_x_m = -chassis.icr_x_m;  // as docs/robot.md says
  EXPECT_EQ(motion.dy + still_x_m * motion.dtheta, 0.0);
  const TwistEstimate estimate =
      estimate_twist(rows, readings_of(chassis, rows, increment_of(chassis, motion)));
  EXPECT_LT((estimate.twist.vector() - motion.vector()).norm(), 1e-13);
}

TEST(EstimateTwist, of_two_pods_through_the_centre_is_the_published_formula) {
  // Pod 2 along X, pod 1 at 90° − α from it: V_X = V2, V_Y = (V1 − V2 sin α)/cos α, ω = ω'.
  const double alpha = radians(7);
  const std::array<Pod, 2> pods{{{0, 0, 0.5 * kPi - alpha}, {0, 0, 0}}};
  const Chassis chassis = dead_wheels(kSize, pods, Gyro{});
  const Rows rows = rows_of(chassis, true);
  EXPECT_LT((Vector3(rows.H.row(0)) - Vector3(std::sin(alpha), std::cos(alpha), 0)).norm(), 1e-15);
  const double v1 = 0.031;
  const double v2 = -0.017;
  const double omega = 0.004;
  Increment increment{.duration_s = 0.05, .gyro_rad = omega, .has_gyro = true};
  increment.turned = {v1 / (kPi * 0.15), v2 / (kPi * 0.15)};
  const Twist2 twist = estimate_twist(rows, readings_of(chassis, rows, increment)).twist;
  EXPECT_NEAR(twist.dx, v2, 1e-16);
  EXPECT_NEAR(twist.dy, (v1 - v2 * std::sin(alpha)) / std::cos(alpha), 1e-16);
  EXPECT_NEAR(twist.dtheta, omega, 1e-16);
}

TEST(EstimateTwist, keeps_its_digits_when_wheels_stand_far_from_the_centre_and_cannot_skid_at_all) {
  Chassis chassis = differential_drive(kSize, 0.4);
  for (Wheel& wheel : chassis.wheels()) wheel.x_m = -0.5;
  chassis.noise.lateral_per_sqrt_m = 0.0;
  const Rows rows = rows_of(chassis, false);
  const Twist2 motion{0.5, 0.5 * 0.1, 0.1};
  const Twist2 twist = estimate_twist(rows, readings_of(chassis, rows, increment_of(chassis, motion))).twist;
  // Variances of 5e-5 and 1e-12 in one normal matrix cost 7 of the 16 digits, and no more.
  EXPECT_LT((twist.vector() - motion.vector()).norm(), 5e-9);
}

TEST(EstimateTwist, covariance_is_the_scatter_over_many_draws) {
  std::mt19937_64 engine(2);
  constexpr int kDraws = 20000;
  for (const Chassis& chassis : {test::with_gyro(differential_drive(kSize, 0.4)), mecanum(kSize, 0.3, 0.4)}) {
    const Rows rows = rows_of(chassis, true);
    const Readings perfect = readings_of(chassis, rows, increment_of(chassis, {0.05, 0.0, 0.02}));
    const TwistEstimate exact = estimate_twist(rows, perfect);
    Matrix3 scatter = Matrix3::Zero();
    for (int i = 0; i < kDraws; ++i) {
      const Vector3 e =
          estimate_twist(rows, test::with_noise(perfect, engine)).twist.vector() - exact.twist.vector();
      scatter += e * e.transpose() / kDraws;
    }
    const Matrix3& S = exact.covariance;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        EXPECT_NEAR(scatter(i, j), S(i, j), 5 * std::sqrt((S(i, i) * S(j, j) + S(i, j) * S(i, j)) / kDraws));
  }
}

// --- the residual test

TEST(ResidualTest, is_what_least_squares_leaves_over) {
  std::mt19937_64 engine(3);
  for (const Chassis& chassis : every_chassis()) {
    const Rows rows = rows_of(chassis, true);
    const Readings readings = readings_of(chassis, rows, noisy_increment(chassis, engine));
    const auto n = rows.measured;
    const Eigen::VectorXd sigma = readings.variance.head(n).cwiseSqrt();
    const Eigen::MatrixXd A = sigma.cwiseInverse().asDiagonal() * Eigen::MatrixXd(rows.H.topRows(n));
    const Eigen::VectorXd b = readings.z.head(n).cwiseQuotient(readings.variance.head(n).cwiseSqrt());
    const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(A);
    const double left_over = (b - A * solver.solve(b)).squaredNorm();
    const ResidualTest test = residual_test(rows, readings);
    EXPECT_NEAR(test.chi2, left_over, 1e-9 * std::max(1.0, left_over));
    EXPECT_EQ(test.degrees_of_freedom, n - solver.rank());
  }
}

TEST(ResidualTest, counts_measured_rows_only) {
  const auto degrees_of_freedom = [](const Chassis& chassis, bool gyro) {
    const Rows rows = rows_of(chassis, gyro);
    return residual_test(rows, readings_of(chassis, rows, increment_of(chassis, {0.05, 0, 0.01})))
        .degrees_of_freedom;
  };
  const Chassis differential = test::with_gyro(differential_drive(kSize, 0.4));
  EXPECT_EQ(degrees_of_freedom(differential, false), 0);  // the lateral row measures nothing
  EXPECT_EQ(degrees_of_freedom(differential, true), 1);
  EXPECT_EQ(degrees_of_freedom(test::with_gyro(skid_steer(kSize, 0.6, 0.5)), true), 3);
  EXPECT_EQ(degrees_of_freedom(omni3(kSize, 0.2), false), 0);
  EXPECT_EQ(degrees_of_freedom(mecanum(kSize, 0.3, 0.4), false), 1);
  EXPECT_EQ(degrees_of_freedom(test::two_pods(), true), 0);
  EXPECT_EQ(degrees_of_freedom(test::three_pods(), true), 1);
  EXPECT_EQ(degrees_of_freedom(test::joined(omni3(kSize, 0.2), test::two_pods()), true), 3);
  EXPECT_EQ(degrees_of_freedom(test::velocity_robot(), true), 1);
}

TEST(ResidualTest, is_chi_square_distributed_when_nothing_slips) {
  std::mt19937_64 engine(4);
  constexpr int kDraws = 20000;
  for (const Chassis& chassis :
       {test::with_gyro(differential_drive(kSize, 0.4)), test::joined(omni3(kSize, 0.2), test::two_pods())}) {
    const Rows rows = rows_of(chassis, true);
    const Readings perfect = readings_of(chassis, rows, increment_of(chassis, {0.05, 0.0, 0.02}));
    double sum = 0.0;
    double sum_of_squares = 0.0;
    int k = 0;
    for (int i = 0; i < kDraws; ++i) {
      const ResidualTest test = residual_test(rows, test::with_noise(perfect, engine));
      k = test.degrees_of_freedom;
      sum += test.chi2;
      sum_of_squares += test.chi2 * test.chi2;
    }
    // χ²(k): mean k, variance 2k, fourth central moment 12k(k + 4).
    const double mean = sum / kDraws;
    const double variance = sum_of_squares / kDraws - mean * mean;
    EXPECT_NEAR(mean, k, 5 * std::sqrt(2.0 * k / kDraws));
    EXPECT_NEAR(variance, 2.0 * k, 5 * std::sqrt((12.0 * k * (k + 4) - 4.0 * k * k) / kDraws));
  }
}

TEST(ResidualTest, does_not_lose_its_rank_to_noise_of_very_different_size) {
  Chassis chassis = test::with_gyro(differential_drive(kSize, 0.4));
  chassis.gyro->noise_rad_s_sqrt_hz = 0.0;  // down to the floor: 1e-9 rad
  chassis.noise.wheel_per_sqrt_m = 1.0;
  const Rows rows = rows_of(chassis, true);
  Readings readings = readings_of(chassis, rows, increment_of(chassis, {100.0, 0, 0}));
  readings.z[0] += 10.0;
  const ResidualTest test = residual_test(rows, readings);
  EXPECT_EQ(test.degrees_of_freedom, 1);
  EXPECT_NEAR(test.chi2, 100.0 / (readings.variance[0] + readings.variance[1]), 1e-6);
}

TEST(ResidualTest, grows_with_a_slip_and_ignores_motion) {
  const Chassis chassis = test::with_gyro(differential_drive(kSize, 0.4));
  const Rows rows = rows_of(chassis, true);
  Readings readings = readings_of(chassis, rows, increment_of(chassis, {0.05, 0.0, 0.3}));
  EXPECT_LT(residual_test(rows, readings).chi2, 1e-9);
  readings.z[1] += 0.02;
  // One check: (z_r − z_l)/b − z_g, against its own variance.
  const double variance = (readings.variance[0] + readings.variance[1]) / 0.16 + readings.variance[2];
  EXPECT_NEAR(residual_test(rows, readings).chi2, 0.05 * 0.05 / variance, 1e-9);
}

}  // namespace
}  // namespace trundle::chassis
