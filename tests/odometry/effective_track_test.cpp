#include "trundle/odometry/effective_track.hpp"

#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/simulation/scenario.hpp"

#include "scale.hpp"

namespace trundle::odometry {
namespace {

Robot skid_steer_with(double track_m) {
  Robot robot;
  robot.name = "skid";
  robot.chassis = skid_steer({0.25, 2000.0, 0}, track_m, 0.3);
  robot.chassis.gyro = Gyro{.bias_rad_s = 0.0, .noise_rad_s_sqrt_hz = 1e-3};
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  return robot;
}

/// A tour on ground where the track is that wide; the file says 0.40 m and no bias.
AlignedReadings tour_on(double track_m, std::uint64_t seed, double length_m = 40.0) {
  Scenario scenario;
  scenario.nominal = skid_steer_with(0.40);
  scenario.truth = skid_steer_with(track_m);
  scenario.truth.chassis.gyro->bias_rad_s = 0.003;
  Random random(seed, 5);
  scenario.path = random_tour({.length_m = length_m}, {}, random, {.forward_m_s = 0.5});
  scenario.steering = Steering::truth;
  scenario.seed = seed;
  return align(simulate(scenario).recording, scenario.nominal);
}

void append(AlignedReadings& readings, const AlignedReadings& more) {
  const double shift = readings.increments.back().time_s - more.start_s;
  for (Increment increment : more.increments) {
    increment.time_s += shift;
    readings.increments.push_back(increment);
  }
}

TEST(EffectiveTrack, is_found_with_an_honest_interval) {
  const int trials = test::trials(300, 30);
  int inside = 0;
  for (int i = 0; i < trials; ++i) {
    const auto found =
        effective_tracks(tour_on(0.62, 100 + static_cast<std::uint64_t>(i)), skid_steer_with(0.40).chassis);
    ASSERT_EQ(found.size(), 1U) << "a false alarm, seed " << 100 + i;
    const double error = found[0].track_m - 0.62;
    inside += std::abs(error) < 1.96 * found[0].sigma_m ? 1 : 0;
    EXPECT_LT(found[0].sigma_m, 0.01);
  }
  const double share = static_cast<double>(inside) / trials;
  EXPECT_GE(share, 0.92 - 3.0 * std::sqrt(0.95 * 0.05 / trials));
}

TEST(EffectiveTrack, a_change_of_ground_raises_the_alarm_and_is_learned) {
  const int trials = test::trials(50, 10);
  for (int i = 0; i < trials; ++i) {
    const auto seed = 500 + static_cast<std::uint64_t>(2 * i);
    AlignedReadings readings = tour_on(0.62, seed);
    const double change_s = readings.increments.back().time_s;
    append(readings, tour_on(0.85, seed + 1));
    const auto found = effective_tracks(readings, skid_steer_with(0.40).chassis);
    ASSERT_EQ(found.size(), 2U) << "seed " << seed;
    EXPECT_NEAR(found[0].track_m, 0.62, 5.0 * found[0].sigma_m + 0.01);
    EXPECT_NEAR(found[1].track_m, 0.85, 5.0 * found[1].sigma_m);
    EXPECT_GT(found[1].start_s, change_s);
    EXPECT_LT(found[1].start_s, change_s + 20.0);
  }
}

TEST(EffectiveTrack, is_not_told_before_the_robot_turns) {
  Scenario scenario;
  scenario.nominal = scenario.truth = skid_steer_with(0.40);
  scenario.path = straight(5.0);
  const AlignedReadings readings = align(simulate(scenario).recording, scenario.nominal);
  EXPECT_TRUE(effective_tracks(readings, scenario.nominal.chassis).empty());
}

TEST(EffectiveTrack, copies_and_states_continue_alike) {
  const AlignedReadings readings = tour_on(0.62, 7);
  EffectiveTrack whole(skid_steer_with(0.40).chassis), second(skid_steer_with(0.40).chassis);
  const std::size_t middle = readings.increments.size() / 2;
  for (std::size_t i = 0; i < readings.increments.size(); ++i) {
    whole.step(readings.increments[i]);
    if (i == middle) second.resume(whole.state());
    if (i > middle) second.step(readings.increments[i]);
  }
  EXPECT_EQ(std::memcmp(&whole.state(), &second.state(), sizeof(EffectiveTrackState)), 0);
}

TEST(EffectiveTrack, needs_two_sides_and_a_gyro) {
  Robot robot = skid_steer_with(0.40);
  robot.chassis.gyro.reset();
  EXPECT_THROW(EffectiveTrack{robot.chassis}, CannotAnswer);
  EXPECT_FALSE(EffectiveTrack::applies_to(omni3({}, 0.2)));
  Chassis velocity;
  velocity.gyro = Gyro{};
  EXPECT_FALSE(EffectiveTrack::applies_to(velocity));
}

}  // namespace
}  // namespace trundle::odometry
