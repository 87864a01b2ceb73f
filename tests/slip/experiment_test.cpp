// The experiment of source 2: ten metres straight on, wheels that spin now and then.
#include <algorithm>
#include <cmath>

#include <fmt/core.h>
#include <gtest/gtest.h>

#include "trundle/simulation/scenario.hpp"
#include "trundle/slip/find_slip.hpp"

#include "scale.hpp"

namespace trundle {
namespace {

constexpr double kRest_s = 10.0;
constexpr double kLength_m = 10.0;
constexpr double kSpeed_m_s = 0.25;

Robot nominal_robot() {
  Robot robot;
  robot.name = "source 2";
  robot.wheel_names = {"left", "right"};
  robot.chassis = differential_drive({.diameter_m = 0.15, .ticks_per_revolution = 1024.0}, 0.5);
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4, .bias_walk_rad_s_sqrt_s = 1e-5};
  robot.chassis.noise.wheel_per_sqrt_m = 0.001;
  return robot;
}

Scenario drive_of(std::uint64_t seed, Steering steering) {
  Scenario scenario;
  scenario.nominal = nominal_robot();
  scenario.truth = scenario.nominal;
  scenario.truth.chassis.gyro->bias_rad_s = 0.02;
  scenario.path = joined({pause(kRest_s), straight(kLength_m, {.forward_m_s = kSpeed_m_s})});
  scenario.steering = steering;
  scenario.encoders.rate_hz = 4.0;
  scenario.gyro.rate_hz = 100.0;
  scenario.seed = seed;
  return scenario;
}

/// Bursts of 0.25 to 1 s on random wheels, none overlapping another.
void add_bursts(Scenario& scenario, double greatest_factor) {
  Random random(scenario.seed, 100);
  const std::uint64_t count = 2 + random.below(6);
  double clock = kRest_s + 1.0;
  const double room = (kLength_m / kSpeed_m_s - 2.0) / static_cast<double>(count);
  for (std::uint64_t i = 0; i < count; ++i, clock += room) {
    SlipBurst burst;
    burst.wheel = static_cast<int>(random.below(2));
    burst.span.duration_s = random.uniform(0.25, 1.0);
    burst.span.start_s = clock + random.uniform(0.0, room - burst.span.duration_s - 0.5);
    burst.factor = random.uniform(1.2, greatest_factor);
    scenario.slips.push_back(burst);
  }
}

double end_error(const AlignedReadings& readings, const Robot& robot, const Truth& truth) {
  const Pose2 end = integrate(readings, robot, {.with_covariance = false}).trajectory.poses.back().pose;
  return (end.translation() - truth.body.poses.back().pose.translation()).norm();
}

struct Outcome {
  double wheels_alone = 0.0;  ///< end error [m]
  double fused = 0.0;         ///< wheels and gyro, slip not judged
  double published = 0.0;
  double general = 0.0;
};

Robot with_learned_bias(Robot robot, const AlignedReadings& readings) {
  double turn = 0.0;
  double time = 0.0;
  for (const Increment& i : readings.increments) {
    if (i.time_s > kRest_s) break;
    turn += i.gyro_rad;
    time += i.duration_s;
  }
  robot.chassis.gyro->bias_rad_s = turn / time;
  return robot;
}

Robot without_gyro(Robot robot) {
  robot.chassis.gyro.reset();
  return robot;
}

Outcome outcome_of(const Scenario& scenario) {
  const Simulation run = simulate(scenario);
  const AlignedReadings readings = align(run.recording, scenario.nominal);
  const Robot robot = with_learned_bias(scenario.nominal, readings);
  const auto corrected = [&](SlipMethod method) {
    return end_error(find_slip(readings, {}, robot, {.method = method}).corrected, robot, run.truth);
  };
  return {end_error(readings, without_gyro(robot), run.truth), end_error(readings, robot, run.truth),
          corrected(SlipMethod::published), corrected(SlipMethod::general)};
}

double quantile(std::vector<double> values, double q) {
  std::ranges::sort(values);
  const double at = q * static_cast<double>(values.size() - 1);
  const auto i = static_cast<std::size_t>(at);
  const std::size_t j = std::min(i + 1, values.size() - 1);
  return values[i] + (at - static_cast<double>(i)) * (values[j] - values[i]);
}

std::vector<double> of(const std::vector<Outcome>& outcomes, double (*f)(const Outcome&)) {
  std::vector<double> values;
  for (const Outcome& o : outcomes) values.push_back(f(o));
  return values;
}

void tell(const char* what, const std::vector<double>& v) {
  fmt::print("  {:<28} median {:.4f}, 5 % {:.4f}, 95 % {:.4f}, largest {:.4f}\n", what, quantile(v, 0.5),
             quantile(v, 0.05), quantile(v, 0.95), quantile(v, 1.0));
}

std::vector<Outcome> slipping_runs(Steering steering, double greatest_factor) {
  const auto wanted = static_cast<std::size_t>(test::trials(200));
  std::vector<Outcome> outcomes;
  for (std::uint64_t seed = 1; outcomes.size() < wanted && seed < 100 * wanted; ++seed) {
    Scenario scenario = drive_of(seed, steering);
    add_bursts(scenario, greatest_factor);
    const Outcome outcome = outcome_of(scenario);
    if (outcome.wheels_alone > 0.4 && outcome.wheels_alone < 0.85) outcomes.push_back(outcome);
  }
  return outcomes;
}

void expect_improvement(const std::vector<Outcome>& outcomes) {
  const auto general = of(outcomes, [](const Outcome& o) { return o.wheels_alone / o.general; });
  const auto published = of(outcomes, [](const Outcome& o) { return o.wheels_alone / o.published; });
  const auto paired = of(outcomes, [](const Outcome& o) { return o.general / o.published; });
  tell("wheels alone [m]", of(outcomes, [](const Outcome& o) { return o.wheels_alone; }));
  tell("fused, slip not judged [m]", of(outcomes, [](const Outcome& o) { return o.fused; }));
  tell("general [m]", of(outcomes, [](const Outcome& o) { return o.general; }));
  tell("published [m]", of(outcomes, [](const Outcome& o) { return o.published; }));
  tell("times better, general", general);
  tell("times better, published", published);
  tell("general / published", paired);
  EXPECT_GE(quantile(general, 0.5), 10.0);
  EXPECT_GE(quantile(general, 0.05), 5.0);
  EXPECT_GE(quantile(published, 0.5), 10.0);
  EXPECT_GE(quantile(published, 0.05), 5.0);
  EXPECT_LE(quantile(paired, 0.5), 1.0);
  EXPECT_LE(quantile(paired, 0.95), 1.2);
}

TEST(Experiment, WheelsThatTurnAsCommandedWhileTheRobotSwerves) {
  expect_improvement(slipping_runs(Steering::odometry, 2.0));
}

TEST(Experiment, WheelsThatRunAwayWhileTheRobotGoesStraight) {
  expect_improvement(slipping_runs(Steering::truth, 1.45));
}

TEST(Experiment, WithoutSlipNothingGetsWorse) {
  const auto seeds = static_cast<std::uint64_t>(test::trials(200));
  std::vector<Outcome> outcomes;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed)
    outcomes.push_back(outcome_of(drive_of(1000 + seed, Steering::odometry)));
  const auto general = of(outcomes, [](const Outcome& o) { return o.general - o.fused; });
  const auto published = of(outcomes, [](const Outcome& o) { return o.published - o.fused; });
  tell("wheels alone [m]", of(outcomes, [](const Outcome& o) { return o.wheels_alone; }));
  tell("fused [m]", of(outcomes, [](const Outcome& o) { return o.fused; }));
  tell("general - fused [m]", general);
  tell("published - fused [m]", published);
  EXPECT_LE(quantile(general, 1.0), 0.005);
  EXPECT_LE(quantile(published, 1.0), 0.005);
}

}  // namespace
}  // namespace trundle
