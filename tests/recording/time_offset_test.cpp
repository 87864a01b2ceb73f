#include "trundle/recording/time_offset.hpp"

#include <array>
#include <cmath>
#include <span>

#include <gtest/gtest.h>

#include "trundle/simulation/scenario.hpp"
#include "trundle/statistics/distribution.hpp"

#include "recording/robots.hpp"
#include "scale.hpp"

namespace trundle::recording {
using namespace simulation;
namespace {

struct Rates {
  double encoders_hz;
  double gyro_hz;
};

/// How noisy both sensors are.
struct Noise {
  double gyro_rad_s_sqrt_hz = 3e-4;
  double wheel_per_sqrt_m = 0.003;
  double ticks_per_revolution = 5000.0;
};

Robot robot_with_offset(double offset_s, const Noise& noise = {}) {
  Robot robot = test::with_gyro(test::two_wheels(),
                                {.bias_rad_s = 0.01, .noise_rad_s_sqrt_hz = noise.gyro_rad_s_sqrt_hz});
  robot.chassis.noise.wheel_per_sqrt_m = noise.wheel_per_sqrt_m;
  for (Wheel& wheel : robot.chassis.wheels()) wheel.ticks_per_revolution = noise.ticks_per_revolution;
  robot.chassis.gyro->time_offset_s = offset_s;
  return robot;
}

Recording tour_with_offset(double offset_s, const Rates& rates, std::uint64_t seed, const Noise& noise = {}) {
  Scenario scenario;
  scenario.nominal = robot_with_offset(0.0, noise);
  scenario.truth = robot_with_offset(offset_s, noise);
  Random random(seed, 99);
  scenario.path = random_tour({.length_m = 15.0}, {}, random);
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = rates.encoders_hz;
  scenario.gyro.rate_hz = rates.gyro_hz;
  scenario.seed = seed;
  return simulate(scenario).recording;
}

/// Rates of which one is a multiple of the other tell the same of each sample: an offset that is found where
/// noise averages out is found there in every window.
constexpr Rates kAtRates[] = {{10.0, 10.0},  {20.0, 20.0},  {50.0, 50.0}, {20.0, 100.0},
                              {10.0, 200.0}, {100.0, 25.0}, {50.0, 10.0}, {25.0, 30.0}};

TEST(TimeOffset, is_found_within_its_sigma_at_every_rate_and_noise) {
  constexpr std::array kOffsets_s = {0.02, -0.08, 0.0, 0.05, -0.033};
  const auto offsets_s =
      std::span(kOffsets_s).first(static_cast<std::size_t>(test::trials(kOffsets_s.size(), 1)));
  std::uint64_t seed = 1;
  for (const Noise& noise : {Noise{}, Noise{.gyro_rad_s_sqrt_hz = 1e-2}, Noise{.gyro_rad_s_sqrt_hz = 3e-2},
                             Noise{.wheel_per_sqrt_m = 0.02}, Noise{.ticks_per_revolution = 500.0},
                             Noise{.gyro_rad_s_sqrt_hz = 2e-2, .wheel_per_sqrt_m = 0.02}}) {
    double squares = 0.0, sum = 0.0;
    int trials = 0;
    for (const Rates& rates : kAtRates)
      for (const double offset_s : offsets_s) {
        const auto found =
            gyro_time_offset(tour_with_offset(offset_s, rates, seed++, noise), robot_with_offset(0.0, noise));
        ASSERT_TRUE(found) << rates.encoders_hz << " Hz, " << rates.gyro_hz << " Hz, " << offset_s << " s";
        const double error = (found->offset_s - offset_s) / found->sigma_s;
        EXPECT_LT(std::abs(error), 4.5)
            << rates.encoders_hz << " Hz, " << rates.gyro_hz << " Hz, " << offset_s << " s";
        squares += error * error;
        sum += error;
        ++trials;
      }
    // Errors of their sigma, N(0, 1): outside in one of a thousand such sums.
    EXPECT_LT(squares, chi_squared_limit(5e-4, trials));
    EXPECT_GT(squares, chi_squared_limit(1.0 - 5e-4, trials));
    EXPECT_LT(std::abs(sum), normal_limit(1e-3) * std::sqrt(trials));
  }
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

// Windows of a tenth of a second over fifty years would be the memory of the machine; the other half tells.
TEST(TimeOffset, is_found_beside_stamps_that_are_years_off) {
  Recording recording = tour_with_offset(0.05, {10.0, 10.0}, 1);
  for (std::size_t i = recording.wheels.time_s.size() / 2; i < recording.wheels.time_s.size(); ++i)
    recording.wheels.time_s[i] += 1.7e9;
  const auto offset = gyro_time_offset(recording, robot_with_offset(0.0));
  ASSERT_TRUE(offset);
  EXPECT_NEAR(offset->offset_s, 0.05, 4.0 * offset->sigma_s);
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
