#include "trundle/chassis/scrub.hpp"

#include <gtest/gtest.h>

#include "trundle/chassis/rows.hpp"

#include "robots.hpp"

namespace trundle::chassis {
namespace {

using test::kSize;

Chassis scrubbing(double scrub) {
  Chassis chassis = skid_steer(kSize, 0.6, 0.5);
  chassis.scrub = scrub;
  return chassis;
}

/// Front left, front right, rear left, rear right.
std::array<double, kMaxWheels> sides(double left, double right) {
  return {left, right, left, right};
}

/// What is scrubbed over so many intervals that are alike.
double scrubbed(const Chassis& chassis, double left, double right, int intervals) {
  const ScrubGauge gauge(chassis);
  ScrubState state;
  double sum = 0.0;
  for (int i = 0; i < intervals; ++i) {
    Increment increment{.turned = sides(left / intervals, right / intervals)};
    gauge.add(state, increment);
    sum += increment.scrub_turned;
  }
  return sum;
}

TEST(Scrub, sharpness_is_that_of_the_turn_whatever_its_size_and_sense) {
  EXPECT_EQ(sharpness(0.0, 0.0), 0.0);
  EXPECT_EQ(sharpness(1.0, 1.0), 0.0);
  EXPECT_EQ(sharpness(-0.3, 0.3), 1.0);
  EXPECT_EQ(sharpness(0.0, -0.7), 0.5);
  EXPECT_DOUBLE_EQ(sharpness(0.1, 0.4), sharpness(-4.0, -1.0));
  // Of a radius ρ on a track b it is 1/(1 + (2ρ/b)²).
  const double radius = 0.8, track = 0.6;
  EXPECT_DOUBLE_EQ(sharpness(radius - 0.5 * track, radius + 0.5 * track),
                   1.0 / (1.0 + std::pow(2.0 * radius / track, 2)));
}

TEST(Scrub, is_of_skid_wheels_on_two_sides_that_are_not_steered) {
  EXPECT_TRUE(can_scrub(skid_steer(kSize, 0.6, 0.5)));
  EXPECT_FALSE(can_scrub(differential_drive(kSize, 0.6)));
  EXPECT_FALSE(can_scrub(omni3(kSize, 0.2)));
  EXPECT_FALSE(can_scrub(test::odd_chassis()));
  EXPECT_FALSE(can_scrub(Chassis{}));
  Chassis steered = skid_steer(kSize, 0.6, 0.5);
  steered.add({.x_m = 0.5, .diameter_m = 0.1, .steering = test::kSteering});
  EXPECT_FALSE(can_scrub(steered));
}

TEST(Scrub, on_the_spot_a_robot_turns_less_by_that_share_and_straight_ahead_nothing_changes) {
  const Chassis chassis = scrubbing(0.2);
  EXPECT_EQ(without_scrub(chassis, sides(0.3, 0.3)), sides(0.3, 0.3));
  EXPECT_EQ(without_scrub(chassis, sides(-0.5, 0.5)), sides(-0.4, 0.4));
  EXPECT_EQ(without_scrub(chassis, sides(0.5, -0.5)), sides(0.4, -0.4));
}

TEST(Scrub, what_turns_amount_to_and_which_amount_to_that_undo_each_other) {
  for (const double scrub : {-0.8, -0.1, 0.0, 0.3, 0.8})
    for (int i = 0; i < 200; ++i) {
      const double angle = 2.0 * kPi * i / 200.0;
      const auto turned = sides(0.1 * std::cos(angle), 0.1 * std::sin(angle));
      const auto again = with_scrub(scrubbing(scrub), without_scrub(scrubbing(scrub), turned));
      for (std::size_t w = 0; w < 4; ++w) EXPECT_NEAR(again[w], turned[w], 1e-14) << scrub << ' ' << angle;
    }
}

TEST(Scrub, readings_are_those_of_the_turns_on_the_ground) {
  const Chassis chassis = test::with_gyro(scrubbing(0.15));
  const Rows rows = rows_of(chassis, true);
  for (const Twist2 motion : {Twist2{0.3, 0.0, 0.1}, Twist2{0.0, 0.0, 0.4}, Twist2{-0.1, 0.0, 0.2}}) {
    const Increment increment = test::increment_of(chassis, motion);
    EXPECT_LT((readings_of(chassis, rows, increment).z - rows.H * motion.vector()).norm(), 1e-14);
    EXPECT_LT((twist_of(chassis, rows, increment).vector() - motion.vector()).norm(), 1e-14);
  }
}

TEST(ScrubGauge, sums_over_a_turn_do_not_depend_on_the_rate) {
  const Chassis chassis = scrubbing(0.1);
  for (const int intervals : {1, 7, 100, 10000}) {
    EXPECT_NEAR(scrubbed(chassis, -2.0, 2.0, intervals), 2.0, 1e-12);
    EXPECT_NEAR(scrubbed(chassis, 0.0, 2.0, intervals), 0.5, 1e-12);
    EXPECT_NEAR(scrubbed(chassis, 2.0, 2.0, intervals), 0.0, 1e-12);
  }
}

TEST(ScrubGauge, counts_of_a_slow_curve_show_how_sharp_it_is) {
  Chassis chassis = scrubbing(0.1);
  const double tick = 1.0 / kSize.ticks_per_revolution;
  const ScrubGauge gauge(chassis);
  ScrubState state;
  double left = 0.0, right = 0.0, sum = 0.0, difference = 0.0;
  for (int i = 1; i <= 20000; ++i) {  // 0.3 and 0.4 ticks in each interval
    const double now_left = std::round(0.3 * i) * tick, now_right = std::round(0.4 * i) * tick;
    Increment increment{.turned = sides(now_left - left, now_right - right)};
    gauge.add(state, increment);
    sum += increment.scrub_turned;
    difference += 0.5 * (now_right - left - (now_left - left)) - 0.5 * (right - left);
    left = now_left, right = now_right;
  }
  // Of single intervals it would be ½ most of the time; rounding in the memory, 1/(24 · 10²), is left.
  EXPECT_NEAR(sum / difference, sharpness(0.3, 0.4), 1.0 / 2400.0);
}

TEST(ScrubGauge, leaves_robots_alone_that_do_not_scrub) {
  EXPECT_FALSE(ScrubGauge(differential_drive(kSize, 0.6)).applies());
  EXPECT_FALSE(ScrubGauge(Chassis{}).applies());
}

}  // namespace
}  // namespace trundle::chassis
