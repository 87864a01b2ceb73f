#include <gtest/gtest.h>

#include "trundle/chassis/without_wheel.hpp"
#include "trundle/geometry/decompositions.hpp"

#include "chassis/robots.hpp"

namespace trundle::chassis {
namespace {

using test::kSize;

constexpr WheelSize kSmall{.diameter_m = 0.065, .ticks_per_revolution = 1600};
constexpr double kWheelbase_m = 0.15;

/// What a tricycle without errors of its own does while its front wheel rolls so far at such an angle.
Twist2 tricycle_twist(double way_m, double steering_rad) {
  const Chassis robot = tricycle(kSmall, kWheelbase_m);
  const Increment increment{
      .duration_s = 0.1, .turned = {way_m / (kPi * 0.065)}, .steering_rad = {steering_rad}};
  return twist_of(robot, rows_of(robot, false), increment);
}

TEST(Steered, a_tricycle_rolls_along_its_front_wheel_and_turns_about_its_rear_axle) {
  for (const double angle : {0.0, 0.2, -0.7, 1.5, 0.5 * kPi, 2.5, kPi}) {
    const Twist2 twist = tricycle_twist(0.02, angle);
    EXPECT_NEAR(twist.dx, 0.02 * std::cos(angle), 1e-12) << angle;
    EXPECT_NEAR(twist.dy, 0.0, 1e-12) << angle;
    EXPECT_NEAR(twist.dtheta, 0.02 * std::sin(angle) / kWheelbase_m, 1e-11) << angle;
  }
}

TEST(Steered, zero_and_scale_turn_the_reading_into_the_direction_of_the_wheel) {
  Wheel wheel{.direction_rad = 0.3, .diameter_m = 0.1};
  EXPECT_EQ(rolling_direction(wheel), 0.3);
  wheel.steering = SteeringSensor{.zero_rad = 0.1, .scale = -2.0, .reading_rad = 0.4};
  EXPECT_DOUBLE_EQ(rolling_direction(wheel), 0.3 - 2.0 * 0.3);
}

TEST(Steered, a_passive_wheel_does_not_skid_and_measures_nothing) {
  const Rows rows = rows_of(tricycle(kSmall, kWheelbase_m), false);
  ASSERT_EQ(rows.count(), 3);
  EXPECT_EQ(rows.measured, 1);
  EXPECT_EQ(rows.row[2].kind, RowKind::lateral);
  EXPECT_EQ(rows.row[2].wheel, 1);
  EXPECT_LT((rows.H.row(2) - Eigen::RowVector3d(0, 1, 0)).norm(), 1e-15);
}

TEST(Steered, passive_wheels_stand_behind_those_with_an_encoder) {
  Chassis chassis;
  chassis.add_passive({.x_m = 1.0});
  chassis.add({.x_m = 2.0});
  chassis.add_passive({.x_m = 3.0});
  chassis.add({.x_m = 4.0});
  std::vector<double> places;
  for (const Wheel& wheel : chassis.all_wheels()) places.push_back(wheel.x_m);
  EXPECT_EQ(places, (std::vector{2.0, 4.0, 1.0, 3.0}));
  EXPECT_EQ(chassis.wheels().size(), 2U);
  while (chassis.all_wheels().size() < kMaxWheels) chassis.add_passive({});
  EXPECT_THROW(chassis.add({}), std::length_error);
  EXPECT_THROW(chassis.add_passive({}), std::length_error);
}

TEST(Steered, each_wheel_of_a_swerve_keeps_its_lateral_row) {
  const Rows rows = rows_of(swerve(kSize, 0.4, 0.5), false);  // all ahead: two and two of them are one
  EXPECT_EQ(rows.count(), 8);
  EXPECT_EQ(rows.measured, 4);
}

TEST(Steered, every_chassis_reads_back_the_motion_that_it_makes) {
  const std::vector<Twist2> of_cars = {{0.05, 0.0, 0.0}, {0.05, 0.0, 0.02}, {-0.04, 0.0, 0.03}};
  std::vector<Twist2> of_swerve = of_cars;
  of_swerve.insert(of_swerve.end(), {{0.0, 0.05, 0.0}, {0.03, -0.02, 0.1}, {0.0, 0.0, 0.1}});
  const auto expect_back = [](const Chassis& chassis, const std::vector<Twist2>& motions) {
    for (const Twist2& motion : motions) {
      const Increment increment = test::steered_increment_of(chassis, motion);
      const Twist2 twist = twist_of(chassis, rows_of(chassis, false), increment);
      EXPECT_LT((twist.vector() - motion.vector()).norm(), 1e-12) << motion.vector().transpose();
    }
  };
  expect_back(tricycle(kSize, 0.6, test::kSteering), of_cars);
  expect_back(ackermann(kSize, 0.4, 0.6, 0.0, test::kSteering), of_cars);
  expect_back(ackermann(kSize, 0.4, 0.6, 0.3, test::kSteering), of_cars);
  expect_back(swerve(kSize, 0.4, 0.5, test::kSteering), of_swerve);
}

TEST(Steered, without_a_wheel_the_others_keep_their_steering) {
  const Chassis chassis = swerve(kSize, 0.4, 0.5);
  const Increment increment = test::steered_increment_of(chassis, {0.03, -0.02, 0.1});
  const Chassis rest = without_wheel(chassis, 1);
  ASSERT_EQ(rest.wheel_count, 3);
  const Twist2 twist = twist_of(rest, rows_of(rest, false), without_wheel(increment, 1));
  EXPECT_LT((twist.vector() - Vector3(0.03, -0.02, 0.1)).norm(), 1e-12);
  EXPECT_EQ(without_wheel(tricycle(kSize, 0.6), 0).passive_count, 1);
}

// --- directions that no row sees

/// One wheel with an encoder off the middle, and the steering of one that stands for both front wheels: where
/// that points across the wheel with the encoder, a turn about it is not seen.
Chassis one_encoder() {
  Chassis car;
  car.add({.y_m = 0.8, .diameter_m = 0.6, .ticks_per_revolution = 100});
  car.add_passive({.x_m = 2.8, .steering = SteeringSensor{}});
  return car;
}

TEST(Steered, rows_that_see_all_of_the_motion_are_left_alone) {
  EXPECT_EQ(rows_at(one_encoder(), {.steering_rad = {0.0, 0.5}}, false).count(),
            rows_of(one_encoder(), false).count());
}

TEST(Steered, a_direction_that_is_not_seen_gets_a_row_that_says_so) {
  const Chassis car = one_encoder();
  const Increment blind{.duration_s = 0.25, .steering_rad = {0.0, std::atan2(2.8, 0.8)}};
  const Rows rows = rows_at(car, blind, false);
  ASSERT_EQ(rows.count(), rows_of(car, false).count() + 1);
  EXPECT_EQ(rows.row[static_cast<std::size_t>(rows.count() - 1)].kind, RowKind::unobserved);
  EXPECT_FALSE(rows.row[static_cast<std::size_t>(rows.count() - 1)].measured());
  EXPECT_EQ(rank_of(rows.H), 3);
  const TwistEstimate estimate = estimate_twist(rows, readings_of(car, rows, blind));
  EXPECT_TRUE(estimate.twist.vector().allFinite());
  // The turn about the wheel with the encoder: half a radian per √s, at the distance of the farthest row.
  const double sigma = std::sqrt(estimate.covariance(2, 2));
  EXPECT_GT(sigma, 0.5 * kUnobservedTurn * std::sqrt(0.25));
  EXPECT_LT(sigma, kUnobservedTurn * std::sqrt(0.25));
}

TEST(Steered, nothing_is_divided_by_near_to_that) {
  const Chassis car = one_encoder();
  for (const double off : {0.0, 1e-12, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3}) {
    const Increment increment{
        .duration_s = 0.1, .turned = {0.01}, .steering_rad = {0.0, std::atan2(2.8, 0.8) + off}};
    const Twist2 twist = twist_of(car, rows_of(car, false), increment);
    EXPECT_TRUE(twist.vector().allFinite()) << off;
  }
}

}  // namespace
}  // namespace trundle::chassis
