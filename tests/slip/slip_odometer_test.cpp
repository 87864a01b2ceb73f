// The online step: no heap, the same bytes as offline, back to the start of an interval that slips.
#include "trundle/slip/slip_odometer.hpp"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "trundle/simulation/scenario.hpp"
#include "trundle/slip/find_slip.hpp"

#include "allocations.hpp"
#include "chassis/robots.hpp"

namespace trundle::slip {
namespace {

using test::allocations;

Robot robot_with_pods() {
  Robot robot = test::robot_of(test::joined(mecanum(test::kSize, 0.4, 0.5), test::two_pods()));
  robot.chassis.noise.wheel_per_sqrt_m = 0.002;
  return robot;
}

Robot differential_with_gyro() {
  Chassis chassis = differential_drive(test::kSize, 0.5);
  chassis.gyro = Gyro{};
  return test::robot_of(chassis);
}

Robot swerve_with_gyro() {
  Chassis chassis = swerve(test::kSize, 0.4, 0.5);
  chassis.gyro = Gyro{};
  return test::robot_of(chassis);
}

Simulation slippery_run(const Robot& robot) {
  Scenario scenario;
  scenario.nominal = robot;
  scenario.truth = robot;
  scenario.steering = Steering::truth;
  scenario.path = joined({pause(3.0), straight(4.0), turn_on_the_spot(1.0), straight(4.0)});
  scenario.random_slips.count = 8;
  scenario.seed = 5;
  return simulate(scenario);
}

SlipOdometer::Options learning() {
  SlipOdometer::Options options;
  options.odometry.learn_gyro_bias = true;
  return options;
}

TEST(SlipOdometer, StepNeedsNoHeap) {
  for (const Robot& robot : {robot_with_pods(), differential_with_gyro(), swerve_with_gyro()}) {
    const AlignedReadings readings = align(slippery_run(robot).recording, robot);
    SlipOdometer odometer(robot, learning());
    std::size_t events = 0;
    const std::size_t before = allocations;
    for (const Increment& increment : readings.increments)
      if (const auto verdict = odometer.step(increment)) events += verdict->ended_count;
    odometer.step_across_gap(readings.increments.front());
    const std::size_t after = allocations;
    EXPECT_EQ(after, before);
    EXPECT_GT(events, 0U);
  }
}

TEST(SlipOdometer, OfflineIsALoopOverItToTheLastBit) {
  for (const SlipMethod method : {SlipMethod::general, SlipMethod::published}) {
    const Robot robot = differential_with_gyro();
    const AlignedReadings readings = align(slippery_run(robot).recording, robot);
    SlipOdometer::Options options = learning();
    options.slip.method = method;
    SlipOdometer online(robot, options);
    for (const Increment& increment : readings.increments) online.step(increment);
    const SlipReport offline = find_slip(readings, {}, robot, options.slip);
    EXPECT_EQ(std::memcmp(&offline.end, &online.odometer().pose(), sizeof(Pose2)), 0);
    // The corrected readings, integrated by plain odometry, end there too.
    Odometer plain(robot, options.odometry);
    for (const Increment& increment : corrected(readings, offline, robot).increments) plain.step(increment);
    EXPECT_EQ(std::memcmp(&plain.pose(), &online.odometer().pose(), sizeof(Pose2)), 0);
    EXPECT_FALSE(offline.events.empty());
  }
}

class EverySlipOdometer : public testing::TestWithParam<Robot> {};
INSTANTIATE_TEST_SUITE_P(Robots, EverySlipOdometer, testing::Values(robot_with_pods(), swerve_with_gyro()));

TEST_P(EverySlipOdometer, ACopyContinuesIndependently) {
  const Robot& robot = GetParam();
  const AlignedReadings readings = align(slippery_run(robot).recording, robot);
  SlipOdometer whole(robot, learning());
  SlipOdometer first(robot, learning());
  const std::size_t half = readings.increments.size() / 2 + 1;
  for (std::size_t i = 0; i < half; ++i) first.step(readings.increments[i]);
  SlipOdometer second = first;
  for (std::size_t i = half; i < readings.increments.size(); ++i) second.step(readings.increments[i]);
  for (const Increment& increment : readings.increments) whole.step(increment);
  EXPECT_EQ(std::memcmp(&whole.odometer().pose(), &second.odometer().pose(), sizeof(Pose2)), 0);
}

TEST(SlipOdometer, TheBiasStartsAsTheDataSheetSaysOrTenTimesAsFarAsSessionsDiffer) {
  Robot robot = differential_with_gyro();
  robot.calibration = CalibrationRecord{};
  const auto parameter = [](std::string name, std::optional<double> sigma_between, bool observable) {
    CalibratedParameter of;
    of.name = std::move(name);
    of.sigma_between = sigma_between;
    of.observable = observable;
    return of;
  };
  robot.calibration->parameters = {parameter("track", {}, true), parameter("gyro.scale", {}, false),
                                   parameter("gyro.bias", 0.003, true)};
  robot.calibration->covariance = Eigen::Vector3d(1e-6, 0.0, 4e-6).asDiagonal();
  const double data_sheet = robot.chassis.gyro->bias_sigma_rad_s;
  const auto sigma = [&] {
    return std::sqrt(SlipOdometer(robot, learning()).odometer().gyro_bias().variance);
  };
  EXPECT_NEAR(sigma(), 0.03, 1e-15);
  robot.calibration->parameters[2].sigma_between = 0.0003;  // three sessions that happen to agree
  EXPECT_EQ(sigma(), data_sheet);
  robot.calibration->parameters[2].sigma_between.reset();
  EXPECT_EQ(sigma(), data_sheet);
}

TEST(SlipOdometer, CovarianceGrowsWhereAWheelSlips) {
  const Robot robot = differential_with_gyro();
  const AlignedReadings readings = align(slippery_run(robot).recording, robot);
  const SlipReport report = find_slip(readings, {}, robot, {});
  const Rows rows = rows_of(robot.chassis, true);
  const auto forward_variance = [&](const Increment& increment) {
    return estimate_twist(rows, readings_of(robot.chassis, rows, increment)).covariance(0, 0);
  };
  const AlignedReadings all = corrected(readings, report, robot);
  std::size_t doubted = 0;
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    const Increment after = all.increments[i];
    EXPECT_EQ(after.turned, readings.increments[i].turned);
    if (after.slip_variance == readings.increments[i].slip_variance) continue;
    EXPECT_GT(forward_variance(after), forward_variance(readings.increments[i]));
    ++doubted;
  }
  EXPECT_GT(doubted, 0U);
}

}  // namespace
}  // namespace trundle::slip
