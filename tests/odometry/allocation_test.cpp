#include <cmath>

#include <gtest/gtest.h>

#include "trundle/chassis/rows.hpp"
#include "trundle/odometry/odometer.hpp"

#include "allocations.hpp"
#include "increments.hpp"

namespace trundle::odometry {
namespace {

using test::allocations;

void expect_no_allocation(const Chassis& chassis) {
  const Robot robot = test::robot_of(chassis);
  const auto increments = test::wandering(robot, 20);
  Odometer odometer(robot, {.parameters = parameters_of(robot)});
  const std::size_t before = allocations;
  for (const Increment& increment : increments) odometer.step(increment);
  odometer.step_across_gap(increments.front());
  const OdometerState saved = odometer.state();
  odometer.resume(saved);
  const PoseSensitivity J = odometer.sensitivity();
  const std::size_t after = allocations;
  EXPECT_EQ(after, before);
  EXPECT_GT(J.norm(), 0.0);
}

void expect_no_allocation_while_learning(const Chassis& chassis) {
  const Robot robot = test::robot_of(chassis);
  auto increments = test::wandering(robot, 200);
  for (std::size_t i = 0; i < 100; ++i) {  // at rest, then with dead encoders
    increments[i].turned = {};
    if (i < 60) increments[i].gyro_rad = chassis.gyro->bias_rad_s * increments[i].duration_s;
  }
  Odometer odometer(robot, {.learn_gyro_bias = true});
  const std::size_t before = allocations;
  bool rested = false;
  bool stuck = false;
  for (const Increment& increment : increments) {
    const Verdict verdict = odometer.step(increment);
    rested = rested || verdict.at_rest();
    stuck = stuck || verdict.stuck != 0;
  }
  const std::size_t after = allocations;
  EXPECT_EQ(after, before);
  EXPECT_TRUE(rested);
  EXPECT_TRUE(stuck);
}

TEST(Allocation, TheCounterCounts) {
  const std::size_t before = allocations;
  ::operator delete(::operator new(1));
  const std::size_t after = allocations;
  EXPECT_EQ(after, before + 1);
}

TEST(Allocation, StepNeedsNoHeap) {
  expect_no_allocation(differential_drive(test::kSize, 0.5));
  expect_no_allocation(mecanum(test::kSize, 0.4, 0.5));
  expect_no_allocation(test::two_pods());
  expect_no_allocation(test::odd_chassis());
  expect_no_allocation(test::with_gyro(test::odd_steered_chassis()));
  expect_no_allocation(swerve(test::kSize, 0.4, 0.5));
}

TEST(Allocation, NorDoesLearningTheBias) {
  expect_no_allocation_while_learning(test::with_gyro(differential_drive(test::kSize, 0.5)));
  expect_no_allocation_while_learning(test::with_gyro(mecanum(test::kSize, 0.4, 0.5)));
  expect_no_allocation_while_learning(test::two_pods());
}

// The steered wheel points across the one with the encoder: a turn about that is in no row.
TEST(Allocation, NorDoesADirectionThatIsNotSeen) {
  Chassis car;
  car.add({.y_m = 0.8, .diameter_m = 0.6, .ticks_per_revolution = 100});
  car.add_passive({.x_m = 2.8, .steering = SteeringSensor{}});
  const Increment blind{.duration_s = 0.25, .steering_rad = {0.0, std::atan2(2.8, 0.8)}};
  ASSERT_GT(rows_at(car, blind, false).count(), rows_of(car, false).count());
  Odometer odometer(test::robot_of(car), {});
  const std::size_t before = allocations;
  odometer.step(blind);
  const std::size_t after = allocations;
  EXPECT_EQ(after, before);
}

}  // namespace
}  // namespace trundle::odometry
