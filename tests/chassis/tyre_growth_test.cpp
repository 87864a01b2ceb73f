#include "trundle/chassis/tyre_growth.hpp"

#include <random>

#include <gtest/gtest.h>

#include "trundle/chassis/ground_turned.hpp"

#include "robots.hpp"

namespace trundle::chassis {
namespace {

using test::kSize;

Chassis growing(double tyre_growth_s2_m2, Chassis chassis = differential_drive(kSize, 0.5)) {
  chassis.tyre_growth_s2_m2 = tyre_growth_s2_m2;
  return chassis;
}

const double kAround_m = kPi * kSize.diameter_m;

TEST(TyreGrowth, at_a_speed_a_wheel_rolls_further_by_that_share_of_its_square) {
  const auto ground = without_growth(growing(0.01), {0.2, -0.4}, 0.1);
  const double left = kAround_m * 2.0, right = kAround_m * 4.0;  // [m/s]
  EXPECT_DOUBLE_EQ(ground[0], 0.2 * (1.0 + 0.01 * left * left));
  EXPECT_DOUBLE_EQ(ground[1], -0.4 * (1.0 + 0.01 * right * right));
}

TEST(TyreGrowth, what_turns_amount_to_and_which_amount_to_that_undo_each_other) {
  for (const double growth : {-0.02, -1e-6, 0.0, 1e-9, 0.05, 1.0})
    for (const double turned : {-0.8, -0.1, 0.0, 1e-6, 0.3, 0.8}) {
      const Chassis chassis = growing(growth);  // at most 8 turns a second, 3.8 m/s
      const auto again = with_growth(chassis, without_growth(chassis, {turned, 0.5}, 0.1), 0.1);
      EXPECT_NEAR(again[0], turned, 1e-14) << growth;
      EXPECT_NEAR(again[1], 0.5, 1e-14) << growth;
    }
}

TEST(TyreGrowth, a_wheel_that_shrinks_has_a_fastest_speed) {
  const Chassis chassis = growing(-0.1);
  const double fastest = 1.0 / std::sqrt(3.0 * 0.1);  // [m/s]
  for (const double metres : {10.0, 1e6, 1e200})
    EXPECT_NEAR(kAround_m * with_growth(chassis, {metres / kAround_m}, 1.0)[0], fastest, 1e-12);
}

TEST(TyreGrowth, readings_are_those_of_the_turns_on_the_ground) {
  for (Chassis chassis : {growing(0.02), growing(0.02, test::with_gyro(skid_steer(kSize, 0.6, 0.5))),
                          growing(-0.02, omni3(kSize, 0.2))}) {
    const Rows rows = rows_of(chassis, chassis.gyro.has_value());
    for (const Twist2 motion : {Twist2{0.1, 0.0, 0.1}, Twist2{0.0, 0.0, 0.4}, Twist2{-0.1, 0.0, 0.02}}) {
      const Increment increment = test::increment_of(chassis, motion);
      EXPECT_LT((readings_of(chassis, rows, increment).z - rows.H * motion.vector()).norm(), 1e-14);
      EXPECT_LT((twist_of(chassis, rows, increment).vector() - motion.vector()).norm(), 1e-14);
    }
  }
}

TEST(TyreGrowth, matters_where_it_is_or_where_a_calibration_says_how_far_it_may_be) {
  Robot robot;
  EXPECT_FALSE(depends_on_speed(robot));
  robot.chassis = growing(0.0);
  EXPECT_FALSE(depends_on_speed(robot));
  robot.calibration.emplace();
  robot.calibration->parameters.push_back({.name = "tyre_growth", .unit = "s^2/m^2"});
  EXPECT_TRUE(depends_on_speed(robot));
  robot.calibration.reset();
  robot.chassis = growing(-1e-4);
  EXPECT_TRUE(depends_on_speed(robot));
}

/// Mean square of the speed [1/s²] that counts show which follow from `turned` at these stamps.
template <class Turned>
double seen_square(const Chassis& chassis, const std::vector<double>& time_s, const Turned& turned) {
  const SpeedGauge gauge(chassis);
  const double ticks = chassis.wheels()[0].ticks_per_revolution;
  const auto counted = [&](double t) { return std::floor(ticks * turned(t)) / ticks; };
  SpeedState state;
  double sum = 0.0, way = 0.0;
  for (std::size_t i = 1; i < time_s.size(); ++i) {
    Increment increment{.time_s = time_s[i], .duration_s = time_s[i] - time_s[i - 1]};
    increment.turned[0] = counted(time_s[i]) - counted(time_s[i - 1]);
    gauge.add(state, increment);
    sum += increment.speed_turned[0];
    way += increment.turned[0];
  }
  return sum / way;
}

/// Stamps so often a second, uneven by half an interval.
std::vector<double> uneven_stamps(double rate_hz, double until_s) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> share(0.5, 1.5);
  std::vector<double> time_s{0.0};
  while (time_s.back() < until_s) time_s.push_back(time_s.back() + share(random) / rate_hz);
  return time_s;
}

TEST(SpeedGauge, neither_the_rate_nor_the_rounding_of_counts_changes_the_square_of_a_speed) {
  for (const double ticks : {60.0, 1000.0, 20000.0})
    for (const double rate_hz : {5.0, 20.0, 100.0, 1000.0}) {
      Chassis chassis = differential_drive({0.1, ticks, 0}, 0.5);
      const double speed = 1.5;
      const double square =
          seen_square(chassis, uneven_stamps(rate_hz, 200.0), [&](double t) { return speed * t; });
      // Rounding in the memory: two of 1/12 count² over 20, once more for the share of the interval itself.
      EXPECT_NEAR(square, speed * speed, 0.04 * speed * speed) << ticks << ' ' << rate_hz;
      EXPECT_GT(square, 0.999 * speed * speed) << ticks << ' ' << rate_hz;
    }
}

TEST(SpeedGauge, what_it_lags_behind_while_speeding_up_cancels_when_slowing_down) {
  const Chassis chassis = differential_drive({0.1, 60.0, 0}, 0.5);
  // A rate 3 (1 − cos t) has the integral 3 (t − sin t); ∫ rate³ / ∫ rate = 9 · 5/2 over whole turns.
  const double square =
      seen_square(chassis, uneven_stamps(50.0, 20.0 * kPi), [](double t) { return 3.0 * (t - std::sin(t)); });
  EXPECT_NEAR(square, 22.5, 0.02 * 22.5);
}

TEST(SpeedGauge, stays_finite_where_a_counter_leaps) {
  const Chassis chassis = growing(1.0);
  for (const double turned : {1e300, -1e300}) {
    Increment increment{.duration_s = 1e-9, .turned = {turned, 0.0}};
    SpeedState state;
    SpeedGauge(chassis).add(state, increment);
    EXPECT_TRUE(std::isfinite(ground_turned(chassis, 0, increment)));
  }
  Increment at_once{.turned = {0.1, 0.1}};
  SpeedState state;
  SpeedGauge(chassis).add(state, at_once);
  EXPECT_EQ(ground_turned(chassis, 0, at_once), 0.1);
}

}  // namespace
}  // namespace trundle::chassis
