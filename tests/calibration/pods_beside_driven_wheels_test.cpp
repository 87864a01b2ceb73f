// Driven wheels with three pods behind them and no gyro: the sideways pod and wheels that do not skid tell
// the heading too. Their track counted as exact, and the noise of wheels came out up to eleven times too
// large.
#include <algorithm>
#include <cstdint>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/simulated_runs.hpp"
#include "calibration/stated_errors.hpp"
#include "chassis/robots.hpp"
#include "scale.hpp"

namespace trundle::calibration::pods_beside_driven_wheels {
namespace {

constexpr double kChance = 1e-3;
constexpr double kNoiseOfDriven = 0.005, kNoiseOfPods = 0.002;  // [m/√m]

Robot with_pods() {
  Chassis pods = test::three_pods();
  pods.gyro.reset();
  Robot robot = test::robot_of(test::joined(differential_drive({0.1, 4096.0, 0}, 0.3), pods),
                               {"left", "right", "p1", "p2", "p3"});
  robot.chassis.noise.wheel_per_sqrt_m = kNoiseOfDriven;
  for (Wheel& wheel : robot.chassis.wheels())
    if (wheel.kind == WheelKind::omni) wheel.noise_per_sqrt_m = kNoiseOfPods;
  return robot;
}

Robot true_with_pods() {
  Robot robot = with_pods();
  constexpr double kLarger[] = {0.975, 1.018, 1.004, 0.995, 1.0};
  for (int i = 0; i < 5; ++i) {
    const Parameter diameter{ParameterKind::diameter, i};
    set_value(diameter, kLarger[i] * value_of(diameter, robot), robot);
  }
  set_value({ParameterKind::track, -1}, 0.3066, robot);
  set_value({ParameterKind::lever, 2}, value_of({ParameterKind::lever, 2}, robot) + 0.002, robot);
  set_value({ParameterKind::lever, 3}, value_of({ParameterKind::lever, 3}, robot) - 0.003, robot);
  set_value({ParameterKind::direction, 4}, value_of({ParameterKind::direction, 4}, robot) + 0.004, robot);
  return robot;
}

TEST(PodsBesideDrivenWheels, LeaveTheTrackToBeFoundAndTheNoiseAsItIs) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Robot truth = true_with_pods();
  Robot nominal = with_pods();
  nominal.chassis.noise.wheel_per_sqrt_m = 2.0 * kNoiseOfDriven;  // as who has not measured it leaves it
  const int trials = test::trials(8, 3);
  double nees = 0.0, degrees = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const auto runs =
        test::recorded(nominal, truth, test::differential_paths(), static_cast<std::uint64_t>(trial));
    const CalibrationResult result = calibrate(runs, {}, nominal);
    const test::StatedErrors stated = test::stated_errors(result, truth);
    EXPECT_TRUE(std::ranges::any_of(stated.parameters, [](const ParameterEstimate& e) {
      return e.parameter.kind == ParameterKind::track;
    }));
    EXPECT_LT(result.calibrated.chassis.noise.wheel_per_sqrt_m, 3.0 * kNoiseOfDriven);
    nees += stated.nees();
    degrees += stated.expected_nees();
  }
  std::printf("driven wheels and pods: NEES %.2f of each degree of freedom\n", nees / degrees);
  EXPECT_LT(nees, statistics::chi_squared_limit(kChance, degrees));
  EXPECT_GT(nees, statistics::chi_squared_limit(1.0 - kChance, degrees));
}

}  // namespace
}  // namespace trundle::calibration::pods_beside_driven_wheels
