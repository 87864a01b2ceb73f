#include "trundle/odometry/dead_reckon.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "trundle/io/error.hpp"

#include "increments.hpp"
#include "scale.hpp"

namespace trundle::odometry {
namespace {

/// A log as columns, and what dead_reckon makes of it.
struct Columns {
  std::array<std::vector<double>, kMaxWheels> turned, steering_rad;
  std::vector<double> gyro_rad, duration_s;
  std::vector<double> x_m, y_m, heading_rad;

  explicit Columns(const std::vector<Increment>& increments) {
    for (const Increment& increment : increments) {
      for (std::size_t k = 0; k < kMaxWheels; ++k) {
        turned[k].push_back(increment.turned[k]);
        steering_rad[k].push_back(increment.steering_rad[k]);
      }
      duration_s.push_back(increment.duration_s);
      if (increment.has_gyro) gyro_rad.push_back(increment.gyro_rad);
    }
    x_m.resize(increments.size());
    y_m.resize(increments.size());
    heading_rad.resize(increments.size());
  }

  TravelColumns travel() const {
    TravelColumns columns{.gyro_rad = gyro_rad, .duration_s = duration_s};
    for (std::size_t k = 0; k < kMaxWheels; ++k) {
      columns.turned[k] = turned[k];
      columns.steering_rad[k] = steering_rad[k];
    }
    return columns;
  }
  PoseColumns poses() { return {x_m, y_m, heading_rad}; }
};

void expect_same_bits(const Robot& robot, const std::vector<Increment>& increments, const Pose2& start) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    Columns columns(increments);
    hwy::SetSupportedTargetsForTest(target);
    dead_reckon(robot, columns.travel(), start, columns.poses());
    hwy::SetSupportedTargetsForTest(0);
    Odometer odometer(robot, {.start = start, .with_covariance = false});
    for (std::size_t i = 0; i < increments.size(); ++i) {
      odometer.step(increments[i]);
      ASSERT_EQ(columns.x_m[i], odometer.pose().x) << hwy::TargetName(target) << i;
      ASSERT_EQ(columns.y_m[i], odometer.pose().y) << hwy::TargetName(target) << i;
      ASSERT_EQ(columns.heading_rad[i], odometer.pose().heading) << hwy::TargetName(target) << i;
    }
  }
}

Chassis velocity_without_gyro() {
  Chassis chassis = test::velocity_robot();
  chassis.gyro.reset();
  return chassis;
}

TEST(DeadReckon, GivesTheBitsOfTheStepOnEveryInstructionSet) {
  for (const Chassis& chassis :
       {differential_drive(test::kSize, 0.5), omni3(test::kSize, 0.2), test::two_pods(), test::scrubbing(),
        mecanum(test::kSize, 0.4, 0.5), Chassis{}, velocity_without_gyro(), test::velocity_robot(),
        tricycle(test::kSize, 0.6), ackermann(test::kSize, 0.4, 0.6, 0.3), swerve(test::kSize, 0.4, 0.5),
        test::odd_steered_chassis(), test::with_gyro(tricycle(test::kSize, 0.6)),
        test::growing(differential_drive(test::kSize, 0.5)), test::growing(test::scrubbing()),
        test::growing(ackermann(test::kSize, 0.4, 0.6, 0.3))}) {
    const Robot robot = test::robot_of(chassis);
    for (const int rows : {1, 7, 256, 257, 1000})
      expect_same_bits(robot, test::wandering(robot, rows), {0.3, -0.1, 2.0});
  }
}

TEST(DeadReckon, GivesThemBeyondTheKernelsRangeToo) {
  const Robot robot = test::differential_robot();
  auto increments = test::wandering(robot, 1000);
  increments[300] = test::two_wheels(-1.0, 1.0);  // 4 rad in one interval
  expect_same_bits(robot, increments, {0.0, 0.0, 0.0});
  expect_same_bits(robot, increments, {0.0, 0.0, 2e6});
}

TEST(DeadReckon, GivesThemWhereSteeredWheelsSeeNoLongerAllOfTheMotion) {
  Chassis car;  // one encoder, and a front wheel that may point across it
  car.add({.y_m = 0.8, .diameter_m = 0.6, .ticks_per_revolution = 100});
  car.add_passive({.x_m = 2.8, .steering = SteeringSensor{}});
  const Robot robot = test::robot_of(car);
  auto increments = test::wandering(robot, 300);
  increments[100].steering_rad[1] = std::atan2(2.8, 0.8);
  increments[200].steering_rad[1] = 2e6;
  expect_same_bits(robot, increments, {0.3, -0.1, 2.0});
}

TEST(DeadReckon, StaysWithinItsBoundOverAMillionRows) {
  const Robot robot = test::differential_robot();
  const auto increments = test::wandering(robot, test::kSanitizers ? 50'000 : 1'000'000, 0.02);
  Columns columns(increments);
  dead_reckon(robot, columns.travel(), {}, columns.poses());
  long double x = 0.0L;
  long double y = 0.0L;
  long double heading = 0.0L;
  double worst = 0.0;
  const long double metres = static_cast<long double>(kPi) * robot.chassis.wheels()[0].diameter_m;
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const long double left = metres * increments[i].turned[0];
    const long double right = metres * increments[i].turned[1];
    const long double half = (right - left) / 0.5L / 2.0L;
    const long double chord = 0.5L * (left + right) * (half == 0.0L ? 1.0L : std::sin(half) / half);
    x += chord * std::cos(heading + half);
    y += chord * std::sin(heading + half);
    heading += 2.0L * half;
    worst = std::max({worst, std::abs(static_cast<double>(x - columns.x_m[i])),
                      std::abs(static_cast<double>(y - columns.y_m[i]))});
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(DeadReckon, RefusesColumnsOfDifferentLength) {
  const Robot robot = test::differential_robot();
  Columns columns(test::wandering(robot, 10));
  columns.turned[1].pop_back();
  EXPECT_THROW(dead_reckon(robot, columns.travel(), {}, columns.poses()), InputError);
}

TEST(DeadReckon, RefusesSteeredWheelsWithoutTheirSteering) {
  const Robot robot = test::robot_of(tricycle(test::kSize, 0.6));
  Columns columns(test::wandering(robot, 10));
  columns.steering_rad[0].clear();
  EXPECT_THROW(dead_reckon(robot, columns.travel(), {}, columns.poses()), InputError);
}

TEST(DeadReckon, RefusesWhatCannotBeObserved) {
  const Robot robot = test::robot_of(test::two_pods());
  Columns columns(test::wandering(robot, 10));
  columns.gyro_rad.clear();
  columns.duration_s.clear();
  EXPECT_THROW(dead_reckon(robot, columns.travel(), {}, columns.poses()), CannotAnswer);
}

}  // namespace
}  // namespace trundle::odometry
