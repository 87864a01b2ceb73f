// What one increment costs on the robot: odometry with covariance, the gyro's bias, and the slip test.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include "trundle/recording/alignment/align.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/slip/slip_odometer.hpp"

namespace {

using namespace trundle::pipeline;

Robot robot_of(const Chassis& chassis) {
  Robot robot;
  robot.name = "bench";
  robot.chassis = chassis;
  for (int i = 0; i < chassis.wheel_count; ++i) robot.wheel_names.push_back(fmt::format("w{}", i));
  return robot;
}

constexpr WheelSize kSize{.diameter_m = 0.15, .ticks_per_revolution = 2048};

Robot differential() {
  Chassis chassis = differential_drive(kSize, 0.5);
  chassis.gyro = Gyro{};
  return robot_of(chassis);
}

Robot mecanum_with_pods() {
  Chassis chassis = mecanum(kSize, 0.4, 0.5);
  chassis.add({.y_m = 0.1, .kind = WheelKind::omni, .diameter_m = 0.05, .ticks_per_revolution = 2048});
  chassis.add({.x_m = -0.1,
               .direction_rad = 0.5 * kPi,
               .kind = WheelKind::omni,
               .diameter_m = 0.05,
               .ticks_per_revolution = 2048});
  chassis.gyro = Gyro{};
  return robot_of(chassis);
}

/// A drive with slips now and then.
Increments slippery_drive(const Robot& robot) {
  Scenario scenario;
  scenario.nominal = robot;
  scenario.truth = robot;
  scenario.steering = Steering::truth;
  scenario.path = joined({pause(2.0), straight(20.0), turn_on_the_spot(3.0), straight(20.0)});
  scenario.random_slips.count = 20;
  return align(simulate(scenario).recording, robot).increments;
}

/// `interval_s` 0: every increment is judged by itself.
void step(benchmark::State& state, const Robot& robot, double interval_s) {
  const Increments increments = slippery_drive(robot);
  SlipOdometer::Options options;
  options.odometry.learn_gyro_bias = true;
  options.slip.interval_s = interval_s;
  for (auto _ : state) {
    SlipOdometer odometer(robot, options);
    for (const Increment& increment : increments) benchmark::DoNotOptimize(odometer.step(increment));
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * increments.size()));
}

BENCHMARK_CAPTURE(step, differential_every_increment, differential(), 0.0);
BENCHMARK_CAPTURE(step, differential_quarter_second, differential(), 0.25);
BENCHMARK_CAPTURE(step, mecanum_with_pods_every_increment, mecanum_with_pods(), 0.0);
BENCHMARK_CAPTURE(step, mecanum_with_pods_quarter_second, mecanum_with_pods(), 0.25);

}  // namespace

BENCHMARK_MAIN();
