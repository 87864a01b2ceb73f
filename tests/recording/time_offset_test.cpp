#include "trundle/recording/time_offset.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trundle/simulation/scenario.hpp"

#include "recording/robots.hpp"
#include "scale.hpp"

namespace trundle::recording {
using namespace simulation;
namespace {

struct Rates {
  double encoders_hz;
  double gyro_hz;
};

Robot robot_with_offset(double offset_s) {
  Robot robot = test::with_gyro(test::two_wheels(), {.bias_rad_s = 0.01, .noise_rad_s_sqrt_hz = 3e-4});
  robot.chassis.noise.wheel_per_sqrt_m = 0.003;
  for (Wheel& wheel : robot.chassis.wheels()) wheel.ticks_per_revolution = 5000.0;
  robot.chassis.gyro->time_offset_s = offset_s;
  return robot;
}

Recording tour_with_offset(double offset_s, const Rates& rates, std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = robot_with_offset(0.0);
  scenario.truth = robot_with_offset(offset_s);
  Random random(seed, 99);
  scenario.path = random_tour({.length_m = 15.0}, {}, random);
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = rates.encoders_hz;
  scenario.gyro.rate_hz = rates.gyro_hz;
  scenario.seed = seed;
  return simulate(scenario).recording;
}

TEST(TimeOffset, is_found_within_its_sigma_at_several_rates) {
  double squares = 0.0;
  int trials = 0;
  std::uint64_t seed = 1;
  for (const Rates& rates : {Rates{20.0, 100.0}, Rates{50.0, 50.0}, Rates{10.0, 200.0}, Rates{100.0, 25.0}})
    for (int ms = -80; ms <= 80; ms += 20) {
      const auto found =
          gyro_time_offset(tour_with_offset(0.001 * ms, rates, seed++), robot_with_offset(0.0));
      ASSERT_TRUE(found) << rates.encoders_hz << " Hz, " << ms << " ms";
      const double error = found->offset_s - 0.001 * ms;
      EXPECT_LT(std::abs(error), 4.0 * found->sigma_s) << rates.encoders_hz << " Hz, " << ms << " ms";
      EXPECT_LT(found->sigma_s, 0.01);
      EXPECT_GT(found->correlation, 0.9);
      squares += std::pow(error / found->sigma_s, 2);
      ++trials;
    }
  // Neither boastful nor timid: the mean square in units of sigma.
  EXPECT_LT(squares / trials, 1.6);
  EXPECT_GT(squares / trials, 0.2);
}

TEST(TimeOffset, adds_to_what_the_robot_file_says) {
  const auto found = gyro_time_offset(tour_with_offset(0.05, {50.0, 100.0}, 50), robot_with_offset(0.03));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.05, 4.0 * found->sigma_s);
}

TEST(TimeOffset, a_gyro_upside_down_or_of_wrong_scale_does_not_matter) {
  Recording recording = tour_with_offset(0.04, {50.0, 100.0}, 51);
  for (double& rate : recording.gyro.yaw_rate_rad_s) rate *= -1.1;
  const auto found = gyro_time_offset(recording, robot_with_offset(0.0));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.04, 4.0 * found->sigma_s);
  EXPECT_LT(found->correlation, -0.9);
}

TEST(TimeOffset, slip_does_not_move_it) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot_with_offset(0.04);
  scenario.nominal.chassis.gyro->time_offset_s = 0.0;
  Random random(52, 99);
  scenario.path = random_tour({.length_m = 15.0}, {}, random);
  scenario.steering = Steering::truth;
  scenario.random_slips.count = 10;
  scenario.seed = 52;
  const auto found = gyro_time_offset(simulate(scenario).recording, robot_with_offset(0.0));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->offset_s, 0.04, 4.0 * found->sigma_s);
  EXPECT_LT(found->sigma_s, 0.01);
}

TEST(TimeOffset, cannot_be_told_where_the_robot_does_not_turn) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot_with_offset(0.04);
  scenario.path = straight(5.0);
  EXPECT_FALSE(gyro_time_offset(simulate(scenario).recording, robot_with_offset(0.0)));
  scenario.path = circle(1.0, 2.0, TurnSense::ccw);  // always at the same rate, but for start and end
  scenario.truth.chassis.noise.wheel_per_sqrt_m = 0.02;
  const auto found = gyro_time_offset(simulate(scenario).recording, robot_with_offset(0.0));
  if (found) {
    EXPECT_NEAR(found->offset_s, 0.04, 4.0 * found->sigma_s);
  }
}

TEST(TimeOffset, cannot_be_told_without_a_gyro_or_wheels_that_see_turns) {
  const Recording recording = tour_with_offset(0.0, {50.0, 100.0}, 53);
  EXPECT_FALSE(gyro_time_offset(recording, test::two_wheels()));
  Recording silent = recording;
  silent.gyro = {};
  EXPECT_FALSE(gyro_time_offset(silent, robot_with_offset(0.0)));
  Recording mute = recording;  // stamps without readings
  mute.gyro.yaw_rate_rad_s.assign(mute.gyro.time_s.size(), std::nan(""));
  EXPECT_FALSE(gyro_time_offset(mute, robot_with_offset(0.0)));
  Recording raw = recording;  // counts of the sensor, beyond what it can measure
  for (double& rate : raw.gyro.yaw_rate_rad_s) rate = 16384.0 * rate + 3000.0;
  EXPECT_FALSE(gyro_time_offset(raw, robot_with_offset(0.0)));
  Recording bursts = recording;  // a tenth of a second in every two
  std::size_t kept = 0;
  for (std::size_t i = 0; i < recording.gyro.time_s.size(); ++i) {
    if (std::fmod(recording.gyro.time_s[i], 2.0) > 0.1) continue;
    bursts.gyro.time_s[kept] = recording.gyro.time_s[i];
    bursts.gyro.yaw_rate_rad_s[kept++] = recording.gyro.yaw_rate_rad_s[i];
  }
  bursts.gyro.time_s.resize(kept);
  bursts.gyro.yaw_rate_rad_s.resize(kept);
  EXPECT_FALSE(gyro_time_offset(bursts, robot_with_offset(0.0)));
  Robot pods = robot_with_offset(0.0);
  for (Wheel& wheel : pods.chassis.wheels()) wheel.kind = WheelKind::omni;
  EXPECT_FALSE(gyro_time_offset(recording, pods));
}

}  // namespace
}  // namespace trundle::recording
