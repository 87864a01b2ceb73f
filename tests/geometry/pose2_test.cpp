#include "trundle/geometry/pose2.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "geometry/twists.hpp"

namespace trundle::geometry {
namespace {

using test::any_pose;
using test::any_twist;
using test::delicate_twists;
using test::vector_of;

constexpr double kRounding = 1e-13;  // of some metres and turns

double distance(const Pose2& a, const Pose2& b) {
  return (vector_of(a) - vector_of(b)).norm();
}
double distance(const Twist2& a, const Twist2& b) {
  return (a.vector() - b.vector()).norm();
}
double distance(const Matrix3& a, const Matrix3& b) {
  return (a - b).norm();
}

/// exp by its definition: 3×3 matrix exponential, scaling and squaring in long double.
Pose2 exp_by_matrix(const Twist2& twist) {
  using Matrix = Eigen::Matrix<long double, 3, 3>;
  constexpr int kHalvings = 6;
  const long double scale = std::ldexp(1.0L, -kHalvings);
  Matrix X;
  X << 0, -twist.dtheta, twist.dx, twist.dtheta, 0, twist.dy, 0, 0, 0;
  X *= scale;
  Matrix T = Matrix::Identity();
  Matrix term = T;
  for (int i = 1; i < 16; ++i) T += term = term * X / i;
  for (int i = 0; i < kHalvings; ++i) T = T * T;
  return {static_cast<double>(T(0, 2)), static_cast<double>(T(1, 2)), twist.dtheta};
}

Twist2 plus(const Twist2& a, const Vector3& b) {
  return Twist2::from(a.vector() + b);
}

/// ∂ log(base⁻¹ · exp(ξ + δ)) / ∂δ, by central differences.
Matrix3 numeric_right_jacobian(const Twist2& twist) {
  constexpr double h = 1e-5;
  const Pose2 back = exp(twist).inverse();
  Matrix3 J;
  for (int i = 0; i < 3; ++i) {
    const Vector3 step = h * Vector3::Unit(i);
    J.col(i) = (log(back * exp(plus(twist, step))).vector() - log(back * exp(plus(twist, -step))).vector()) /
               (2 * h);
  }
  return J;
}

Matrix3 numeric_left_jacobian(const Twist2& twist) {
  constexpr double h = 1e-5;
  const Pose2 back = exp(twist).inverse();
  Matrix3 J;
  for (int i = 0; i < 3; ++i) {
    const Vector3 step = h * Vector3::Unit(i);
    J.col(i) = (log(exp(plus(twist, step)) * back).vector() - log(exp(plus(twist, -step)) * back).vector()) /
               (2 * h);
  }
  return J;
}

// --- group laws

RC_GTEST_PROP(Pose2, composition_is_associative, ()) {
  const Pose2 a = *any_pose();
  const Pose2 b = *any_pose();
  const Pose2 c = *any_pose();
  RC_ASSERT(distance((a * b) * c, a * (b * c)) < kRounding);
}

RC_GTEST_PROP(Pose2, inverse_undoes_on_both_sides, ()) {
  const Pose2 a = *any_pose();
  RC_ASSERT(distance(a * a.inverse(), Pose2{}) < kRounding);
  RC_ASSERT(distance(a.inverse() * a, Pose2{}) < kRounding);
  RC_ASSERT(distance(a * Pose2{}, a) == 0.0);
}

RC_GTEST_PROP(Pose2, inverse_of_a_product_is_the_product_of_inverses_reversed, ()) {
  const Pose2 a = *any_pose();
  const Pose2 b = *any_pose();
  RC_ASSERT(distance((a * b).inverse(), b.inverse() * a.inverse()) < kRounding);
}

RC_GTEST_PROP(Pose2, acts_on_points, ()) {
  const Pose2 a = *any_pose();
  const Pose2 b = *any_pose();
  const Vector2 p = (*any_pose()).translation();
  RC_ASSERT(((a * b) * p - a * (b * p)).norm() < kRounding);
}

TEST(Pose2, headings_add_and_are_never_wrapped) {
  const Pose2 quarter = exp({1.0, 0.0, 0.5 * kPi});
  Pose2 pose;
  for (int i = 0; i < 8; ++i) pose = pose * quarter;
  EXPECT_DOUBLE_EQ(pose.heading, 4 * kPi);
  EXPECT_NEAR(pose.translation().norm(), 0.0, 1e-14);
  EXPECT_DOUBLE_EQ(pose.inverse().heading, -4 * kPi);
}

TEST(Pose2, a_sensor_ahead_of_a_robot_that_looks_left) {
  const Pose2 world_from_body{1.0, 2.0, 0.5 * kPi};
  const Pose2 body_from_sensor{0.2, 0.0, 0.0};
  EXPECT_LT(distance(world_from_body * body_from_sensor, {1.0, 2.2, 0.5 * kPi}), 1e-15);
}

// --- exp and log

TEST(Exp, is_the_matrix_exponential) {
  for (const Twist2& twist : delicate_twists())
    EXPECT_LT(distance(exp(twist), exp_by_matrix(twist)), 1e-14) << twist.dtheta;
}

RC_GTEST_PROP(Exp, is_the_matrix_exponential_anywhere, ()) {
  const Twist2 twist = *any_twist();
  RC_ASSERT(distance(exp(twist), exp_by_matrix(twist)) < 1e-14);
}

TEST(Exp, keeps_the_translation_at_turn_zero) {
  const Pose2 pose = exp({1.5, -0.5, 0.0});
  EXPECT_EQ(vector_of(pose), Vector3(1.5, -0.5, 0.0));
}

TEST(Exp, half_a_circle_ends_a_diameter_to_the_left) {
  const Pose2 pose = exp({kPi, 0.0, kPi});
  EXPECT_NEAR(pose.x, 0.0, 1e-15);
  EXPECT_DOUBLE_EQ(pose.y, 2.0);
  EXPECT_EQ(pose.heading, kPi);
}

TEST(Exp, a_whole_turn_comes_back_with_its_heading) {
  const Pose2 pose = exp({2 * kPi, 0.0, 2 * kPi});
  EXPECT_NEAR(pose.translation().norm(), 0.0, 1e-14);
  EXPECT_EQ(pose.heading, 2 * kPi);
}

RC_GTEST_PROP(Exp, of_parts_of_one_twist_composes, ()) {
  const Twist2 twist = *any_twist();
  const double s = *test::uniform(-2, 2);
  const double t = *test::uniform(-2, 2);
  const auto part = [&](double u) { return exp({u * twist.dx, u * twist.dy, u * twist.dtheta}); };
  RC_ASSERT(distance(part(s) * part(t), part(s + t)) < kRounding);
}

TEST(Log, undoes_exp) {
  for (const Twist2& twist : delicate_twists()) {
    if (twist.dtheta == -kPi) continue;  // the same direction as +π: see below
    EXPECT_LT(distance(log(exp(twist)), twist), 1e-14) << twist.dx << ' ' << twist.dy << ' ' << twist.dtheta;
  }
}

RC_GTEST_PROP(Log, undoes_exp_and_exp_undoes_log, ()) {
  const Twist2 twist = *any_twist();
  RC_ASSERT(distance(log(exp(twist)), twist) < kRounding);
  const Pose2 pose = *any_pose();
  const Pose2 again = exp(log(pose));
  RC_ASSERT((again.translation() - pose.translation()).norm() < kRounding);
  RC_ASSERT(std::abs(wrap_angle(again.heading - pose.heading)) < kRounding);
}

TEST(Log, takes_a_heading_of_minus_pi_as_plus_pi) {
  for (const double heading : {-kPi, kPi, 3 * kPi}) {
    const Twist2 twist = log({0.0, 2.0, heading});
    EXPECT_EQ(twist.dtheta, kPi);
    EXPECT_NEAR(twist.dx, kPi, 1e-15);
    EXPECT_NEAR(twist.dy, 0.0, 1e-15);
  }
}

TEST(Log, jumps_only_in_the_sign_of_the_turn_at_pi) {
  const Twist2 left = log({0.0, 2.0, std::nextafter(kPi, 0.0)});
  const Twist2 right = log({0.0, 2.0, std::nextafter(-kPi, 0.0)});
  EXPECT_NEAR(left.dx, kPi, 1e-14);
  EXPECT_NEAR(right.dx, -kPi, 1e-14);
  EXPECT_LT(right.dtheta, 0.0);
}

TEST(Log, is_blind_to_whole_turns) {
  const Twist2 plain = log({0.3, -0.2, 0.5});
  const Twist2 turned = log({0.3, -0.2, 0.5 + 6 * kPi});
  EXPECT_LT(distance(plain, turned), 1e-14);
}

// --- adjoint

RC_GTEST_PROP(Adjoint, carries_a_twist_through_a_pose, ()) {
  const Pose2 T = *any_pose();
  const Twist2 twist = *any_twist();
  const Pose2 by_poses = T * exp(twist) * T.inverse();
  const Pose2 by_adjoint = exp(Twist2::from(adjoint(T) * twist.vector()));
  RC_ASSERT(distance(by_poses, by_adjoint) < 1e-12);
}

RC_GTEST_PROP(Adjoint, is_a_homomorphism, ()) {
  const Pose2 a = *any_pose();
  const Pose2 b = *any_pose();
  RC_ASSERT(distance(adjoint(a * b), adjoint(a) * adjoint(b)) < 1e-12);
  RC_ASSERT(distance(adjoint(a) * adjoint(a.inverse()), Matrix3::Identity()) < 1e-12);
}

TEST(Adjoint, of_a_delicate_exp_joins_the_two_jacobians) {
  // Ad(exp ξ) = Jl(ξ) Jr(ξ)⁻¹
  for (const Twist2& twist : delicate_twists())
    EXPECT_LT(distance(adjoint(exp(twist)) * right_jacobian(twist), left_jacobian(twist)), 1e-14)
        << twist.dtheta;
}

// --- Jacobians

TEST(Jacobians, agree_with_numeric_derivatives) {
  for (const Twist2& twist : delicate_twists()) {
    EXPECT_LT(distance(right_jacobian(twist), numeric_right_jacobian(twist)), 1e-9) << twist.dtheta;
    EXPECT_LT(distance(left_jacobian(twist), numeric_left_jacobian(twist)), 1e-9) << twist.dtheta;
  }
}

RC_GTEST_PROP(Jacobians, agree_with_numeric_derivatives_anywhere, ()) {
  const Twist2 twist = *any_twist();
  RC_ASSERT(distance(right_jacobian(twist), numeric_right_jacobian(twist)) < 1e-8);
  RC_ASSERT(distance(left_jacobian(twist), numeric_left_jacobian(twist)) < 1e-8);
}

TEST(Jacobians, near_zero_are_their_series) {
  // Jl = 1 + ad/2 + ad²/6 + ..., to far more digits than differences give.
  for (const double turn : {0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6}) {
    const Twist2 twist{0.7, -0.3, turn};
    Matrix3 ad;
    ad << 0, -turn, twist.dy, turn, 0, -twist.dx, 0, 0, 0;
    const Matrix3 series = Matrix3::Identity() + ad / 2 + ad * ad / 6 + ad * ad * ad / 24;
    EXPECT_LT(distance(left_jacobian(twist), series), 2e-16) << turn;
    EXPECT_EQ(left_jacobian({0, 0, 0}), Matrix3::Identity());
  }
}

RC_GTEST_PROP(Jacobians, inverse_is_the_inverse, ()) {
  const Twist2 twist = *any_twist();
  RC_ASSERT(distance(right_jacobian(twist) * right_jacobian_inverse(twist), Matrix3::Identity()) < 1e-12);
}

}  // namespace
}  // namespace trundle::geometry
