#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "chassis/robots.hpp"

namespace trundle::chassis {
namespace {

using test::kSize;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

Observability of(const Chassis& chassis) {
  return observability(rows_of(chassis, true));
}

TEST(Observability, of_a_differential_drive_is_complete_and_without_a_check) {
  const Observability o = of(differential_drive(kSize, 0.4));
  EXPECT_EQ(o.rank, 3);
  EXPECT_EQ(o.degrees_of_freedom, 0);
  EXPECT_THAT(o.unobservable, IsEmpty());
  EXPECT_THAT(o.confusable, IsEmpty());
  EXPECT_THAT(o.undetectable, ElementsAre(0, 1));
}

TEST(Observability, one_degree_of_freedom_tells_no_two_rows_apart) {
  const Observability o = of(test::with_gyro(differential_drive(kSize, 0.4)));
  EXPECT_EQ(o.degrees_of_freedom, 1);
  EXPECT_THAT(o.confusable, ElementsAre(Pair(0, 1), Pair(0, 2), Pair(1, 2)));
  EXPECT_THAT(o.undetectable, IsEmpty());
}

TEST(Observability, mecanum_alone_can_see_but_not_name_a_slip) {
  const Observability o = of(mecanum(kSize, 0.3, 0.4));
  EXPECT_EQ(o.rank, 3);
  EXPECT_EQ(o.degrees_of_freedom, 1);
  EXPECT_EQ(o.confusable.size(), 6U);
}

TEST(Observability, mecanum_with_pods_and_gyro_tells_every_row_apart) {
  const Observability o = of(test::joined(mecanum(kSize, 0.3, 0.4), test::two_pods()));
  EXPECT_EQ(o.rank, 3);
  EXPECT_EQ(o.degrees_of_freedom, 4);
  EXPECT_THAT(o.confusable, IsEmpty());
  EXPECT_THAT(o.undetectable, IsEmpty());
}

TEST(Observability, omni3_with_pods_and_gyro_tells_every_row_apart) {
  const Observability o = of(test::joined(omni3(kSize, 0.2), test::two_pods()));
  EXPECT_EQ(o.degrees_of_freedom, 3);
  EXPECT_THAT(o.confusable, IsEmpty());
}

TEST(Observability, skid_steer_with_gyro_tells_its_wheels_apart) {
  const Observability o = of(test::with_gyro(skid_steer(kSize, 0.6, 0.5)));
  EXPECT_EQ(o.degrees_of_freedom, 3);
  EXPECT_THAT(o.confusable, IsEmpty());
}

TEST(Observability, two_wheels_of_one_side_alone_are_confusable) {
  // Left wheels at the same y and one right wheel: the left pair checks itself, nothing checks the right one.
  Chassis chassis;
  for (const double y : {0.2, 0.2, -0.2})
    chassis.add({.x_m = chassis.wheel_count * 0.1, .y_m = y, .kind = WheelKind::skid, .diameter_m = 0.1});
  const Observability o = of(chassis);
  EXPECT_EQ(o.degrees_of_freedom, 1);
  EXPECT_THAT(o.undetectable, ElementsAre(2));
  EXPECT_THAT(o.confusable, testing::Contains(Pair(0, 1)));
}

/// Whatever the cosine of a right angle is rounded to.
TEST(Observability, wheels_that_roll_along_their_axle_check_each_other) {
  Chassis chassis = differential_drive({0.1, 1000.0, 0}, 0.3);
  for (Wheel& wheel : chassis.wheels()) wheel.direction_rad = -kPi / 2.0;
  const Combinations P = left_null_space(rows_of(chassis, false));
  ASSERT_EQ(P.cols(), 1);
  EXPECT_NEAR(P(0, 0), -P(1, 0), 1e-12);
}

TEST(Observability, names_the_direction_that_two_pods_without_gyro_miss) {
  const Chassis chassis = test::two_pods();
  const Rows rows = rows_of(chassis, false);
  const Observability o = observability(rows);
  EXPECT_EQ(o.rank, 2);
  ASSERT_EQ(o.unobservable.size(), 1U);
  // The turn is scaled by the largest lever; undone, no row sees that motion.
  Vector3 motion = o.unobservable[0];
  motion.z() /= rows.H.col(2).cwiseAbs().maxCoeff();
  EXPECT_LT((Eigen::MatrixXd(rows.H) * motion).norm(), 1e-12);
  EXPECT_NEAR(o.unobservable[0].norm(), 1.0, 1e-12);
}

TEST(Observability, wheels_of_one_direction_without_a_lateral_row_miss_sideways_motion) {
  Chassis chassis = differential_drive(kSize, 0.4);
  for (Wheel& wheel : chassis.wheels()) wheel.kind = WheelKind::omni;
  const Observability o = of(chassis);
  EXPECT_EQ(o.rank, 2);
  ASSERT_EQ(o.unobservable.size(), 1U);
  EXPECT_NEAR(std::abs(o.unobservable[0].y()), 1.0, 1e-12);
}

TEST(Observability, does_not_depend_on_the_size_of_the_robot) {
  for (const double size : {1e-3, 1.0, 50.0}) {
    Chassis pods;
    pods.add({.y_m = size, .direction_rad = radians(30), .kind = WheelKind::omni, .diameter_m = 0.1});
    pods.add({.y_m = -size, .direction_rad = radians(30), .kind = WheelKind::omni, .diameter_m = 0.1});
    pods.add({.x_m = size, .direction_rad = radians(120), .kind = WheelKind::omni, .diameter_m = 0.1});
    EXPECT_EQ(of(pods).rank, 3) << size;
    pods.wheel_count = 2;
    EXPECT_EQ(of(pods).rank, 2) << size;
    EXPECT_EQ(of(test::with_gyro(pods)).degrees_of_freedom, 1) << size;
  }
}

TEST(Observability, of_a_single_pod_is_one) {
  Chassis chassis;
  chassis.add({.kind = WheelKind::omni, .diameter_m = 0.1});
  EXPECT_EQ(of(chassis).rank, 1);
  EXPECT_EQ(of(chassis).unobservable.size(), 2U);
}

}  // namespace
}  // namespace trundle::chassis
