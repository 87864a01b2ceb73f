#include "trundle/chassis/rows.hpp"

#include <gtest/gtest.h>

#include "chassis/robots.hpp"

namespace trundle::chassis {
namespace {

using test::kSize;

constexpr double kRounding = 1e-15;

void expect_row(const Rows& rows, int i, const Vector3& expected) {
  const Vector3 row = rows.H.row(i);
  EXPECT_LT((row - expected).norm(), kRounding) << "row " << i << ": " << row.transpose();
}

std::vector<RowKind> kinds_of(const Rows& rows) {
  std::vector<RowKind> kinds;
  for (int i = 0; i < rows.count(); ++i) kinds.push_back(rows.row[static_cast<std::size_t>(i)].kind);
  return kinds;
}

TEST(Rows, differential_drive_has_two_rolling_rows_and_one_merged_lateral_row) {
  const Rows rows = rows_of(differential_drive(kSize, 0.4), false);
  ASSERT_EQ(kinds_of(rows), (std::vector{RowKind::wheel, RowKind::wheel, RowKind::lateral}));
  EXPECT_EQ(rows.measured, 2);
  expect_row(rows, 0, {1, 0, -0.2});
  expect_row(rows, 1, {1, 0, 0.2});
  expect_row(rows, 2, {0, 1, 0});
}

TEST(Rows, mecanum_rows_of_the_usual_x_layout) {
  constexpr double lx = 0.2;
  constexpr double ly = 0.15;
  const Rows rows = rows_of(mecanum(kSize, 2 * ly, 2 * lx), false);
  ASSERT_EQ(kinds_of(rows), std::vector(4, RowKind::wheel));
  expect_row(rows, 0, {1, -1, -(lx + ly)});  // front left
  expect_row(rows, 1, {1, 1, lx + ly});      // front right
  expect_row(rows, 2, {1, 1, -(lx + ly)});   // rear left
  expect_row(rows, 3, {1, -1, lx + ly});     // rear right
}

TEST(Rows, omni3_wheels_all_see_a_turn_alike) {
  const Rows rows = rows_of(omni3(kSize, 0.25), false);
  ASSERT_EQ(rows.count(), 3);
  expect_row(rows, 0, {-std::sqrt(0.75), 0.5, 0.25});
  expect_row(rows, 1, {0, -1, 0.25});
  expect_row(rows, 2, {std::sqrt(0.75), 0.5, 0.25});
}

TEST(Rows, skid_steer_has_one_lateral_row_at_the_centre_of_rotation) {
  Chassis chassis = skid_steer(kSize, 0.6, 0.5);
  chassis.icr_x_m = 0.03;
  const Rows rows = rows_of(chassis, false);
  ASSERT_EQ(rows.count(), 5);
  EXPECT_EQ(rows.measured, 4);
  EXPECT_EQ(rows.row[4].kind, RowKind::skid_lateral);
  expect_row(rows, 0, {1, 0, -0.3});
  expect_row(rows, 1, {1, 0, 0.3});
  expect_row(rows, 4, {0, 1, -0.03});
}

TEST(Rows, dead_wheels_have_rolling_rows_and_the_gyro) {
  const Rows rows = rows_of(test::two_pods(), true);
  ASSERT_EQ(kinds_of(rows), (std::vector{RowKind::wheel, RowKind::wheel, RowKind::gyro}));
  expect_row(rows, 0, {1, 0, -0.1});
  expect_row(rows, 1, {0, 1, -0.12});
  expect_row(rows, 2, {0, 0, 1});
  EXPECT_EQ(rows_of(test::two_pods(), false).count(), 2);
}

TEST(Rows, without_wheels_there_are_those_of_a_velocity_stream) {
  const Rows rows = rows_of(test::velocity_robot(), true);
  ASSERT_EQ(kinds_of(rows), (std::vector{RowKind::forward, RowKind::turn, RowKind::gyro, RowKind::lateral}));
  EXPECT_EQ(rows.measured, 3);
  expect_row(rows, 0, {1, 0, 0});
  expect_row(rows, 1, {0, 0, 1});
  expect_row(rows, 3, {0, 1, 0});
}

TEST(Rows, fixed_wheels_of_two_axles_keep_a_lateral_row_for_each) {
  Chassis chassis = skid_steer(kSize, 0.6, 0.5);
  for (Wheel& wheel : chassis.wheels()) wheel.kind = WheelKind::fixed;
  const Rows rows = rows_of(chassis, false);
  ASSERT_EQ(rows.count(), 6);
  expect_row(rows, 4, {0, 1, 0.25});
  expect_row(rows, 5, {0, 1, -0.25});
}

TEST(Rows, lateral_rows_of_a_wheel_and_one_facing_backwards_are_one) {
  Chassis chassis = differential_drive(kSize, 0.4);
  chassis.wheels()[1].direction_rad = kPi;
  EXPECT_EQ(rows_of(chassis, false).count(), 3);
}

TEST(Rows, a_turned_wheel_reads_the_speed_of_its_own_place) {
  // Velocity of the wheel's place under twist ξ, along its direction: an independent way to the same row.
  const Wheel wheel{
      .x_m = 0.3, .y_m = -0.2, .direction_rad = 0.7, .kind = WheelKind::omni, .diameter_m = 0.1};
  const Vector3 twist(0.4, -0.1, 0.9);
  const Vector2 velocity(twist.x() - twist.z() * wheel.y_m, twist.y() + twist.z() * wheel.x_m);
  EXPECT_NEAR(rolling_row(wheel).dot(twist), velocity.dot(Vector2(std::cos(0.7), std::sin(0.7))), kRounding);
  EXPECT_NEAR(lateral_row(wheel).dot(twist), velocity.dot(Vector2(-std::sin(0.7), std::cos(0.7))), kRounding);
}

TEST(Rows, a_mecanum_wheel_is_blind_along_its_free_direction) {
  Chassis chassis = test::odd_chassis();
  for (const Wheel& wheel : chassis.wheels()) {
    if (wheel.kind != WheelKind::mecanum) continue;
    const double free = wheel.direction_rad + 0.5 * kPi + wheel.roller_rad;
    EXPECT_NEAR(rolling_row(wheel).dot(Vector3(std::cos(free), std::sin(free), 0.0)), 0.0, kRounding);
  }
}

// --- readings and their noise

TEST(Readings, wheel_variance_is_of_travel_and_of_rounded_counts) {
  Chassis chassis = differential_drive(kSize, 0.4);
  chassis.noise.wheel_per_sqrt_m = 0.02;
  Increment increment;
  increment.turned = {2.0, -1.0};
  const Readings readings = readings_of(chassis, rows_of(chassis, false), increment);
  const double turn = kPi * 0.15;
  const double q = turn / 2048;
  EXPECT_DOUBLE_EQ(readings.z[0], 2 * turn);
  EXPECT_DOUBLE_EQ(readings.z[1], -turn);
  EXPECT_DOUBLE_EQ(readings.variance[0], 0.02 * 0.02 * 2 * turn + q * q / 6 + 1e-12);
  EXPECT_DOUBLE_EQ(readings.variance[1], 0.02 * 0.02 * turn + q * q / 6 + 1e-12);
}

TEST(Readings, lateral_variance_is_of_the_mean_travel_of_all_wheels) {
  Chassis chassis = differential_drive(kSize, 0.4);
  Increment increment;
  increment.turned = {2.0, -1.0};
  const Readings readings = readings_of(chassis, rows_of(chassis, false), increment);
  EXPECT_EQ(readings.z[2], 0.0);
  EXPECT_DOUBLE_EQ(readings.variance[2], 1e-6 * 1.5 * kPi * 0.15 + 1e-12);

  chassis = skid_steer(kSize, 0.6, 0.5);
  increment.turned = {1.0, 1.0, 1.0, 1.0};
  EXPECT_DOUBLE_EQ(readings_of(chassis, rows_of(chassis, false), increment).variance[4],
                   0.02 * 0.02 * kPi * 0.15 + 1e-12);
}

TEST(Readings, nothing_is_certain_at_standstill) {
  for (const Chassis& chassis :
       {differential_drive(kSize, 0.4), test::odd_chassis(), test::velocity_robot()}) {
    Chassis silent = chassis;
    silent.noise = {0, 0, 0, 0, 0};
    if (silent.gyro) silent.gyro->noise_rad_s_sqrt_hz = 0;
    for (Wheel& wheel : silent.wheels()) wheel.ticks_per_revolution = 0;
    const Rows rows = rows_of(silent, true);
    const Readings readings = readings_of(silent, rows, Increment{});
    EXPECT_GT(readings.variance.minCoeff(), 0.0);
    EXPECT_TRUE(estimate_twist(rows, readings).covariance.allFinite());
  }
}

TEST(Readings, variance_of_the_difference_of_rounded_counts_is_a_sixth_of_a_count_squared) {
  // The claim behind q²/6, by simulation: increments of floor(true count), true count anywhere.
  std::mt19937_64 engine(5);
  std::uniform_real_distribution<double> start(0.0, 1.0);
  std::uniform_real_distribution<double> step(0.0, 100.0);
  constexpr int kDraws = 200000;
  double sum = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    const double a = start(engine);
    const double true_step = step(engine);
    const double error = std::floor(a + true_step) - std::floor(a) - true_step;
    sum += error * error;
  }
  // The error is triangular on (−1, 1): variance 1/6, fourth moment 1/15, so the mean square scatters by
  // 0.0005.
  EXPECT_NEAR(sum / kDraws, 1.0 / 6.0, 5 * std::sqrt((1.0 / 15 - 1.0 / 36) / kDraws));
}

TEST(Readings, gyro_is_freed_of_bias_and_scaled) {
  Chassis chassis = test::velocity_robot();
  chassis.gyro = Gyro{.bias_rad_s = 0.02, .scale = -1.1, .noise_rad_s_sqrt_hz = 0.001};
  const Increment increment{.duration_s = 0.5, .turned = {0.25, 0.1}, .gyro_rad = 0.31, .has_gyro = true};
  const Readings readings = readings_of(chassis, rows_of(chassis, true), increment);
  EXPECT_DOUBLE_EQ(readings.z[2], (0.31 - 0.01) * -1.1);
  EXPECT_DOUBLE_EQ(readings.variance[2], 1e-6 * 1.21 * 0.5 + 1e-18);
}

TEST(Readings, velocity_stream_is_noisy_in_travel_and_turn) {
  Chassis chassis;
  chassis.noise = {.wheel_per_sqrt_m = 0.02, .turn_per_sqrt_m = 0.03, .turn_per_sqrt_rad = 0.04};
  const Increment increment{.duration_s = 0.5, .turned = {-0.25, 0.1}};
  const Readings readings = readings_of(chassis, rows_of(chassis, false), increment);
  EXPECT_EQ(readings.z[0], -0.25);
  EXPECT_EQ(readings.z[1], 0.1);
  EXPECT_DOUBLE_EQ(readings.variance[0], 4e-4 * 0.25 + 1e-12);
  EXPECT_DOUBLE_EQ(readings.variance[1], 16e-4 * 0.1 + 9e-4 * 0.25 + 1e-18);
}

TEST(Readings, velocity_stream_is_corrected_and_its_noise_is_that_of_what_was_read) {
  Chassis chassis = test::velocity_robot();
  chassis.gyro.reset();
  chassis.noise = {.wheel_per_sqrt_m = 0.02, .turn_per_sqrt_m = 0.03, .turn_per_sqrt_rad = 0.04};
  const Increment increment{.duration_s = 0.5, .turned = {-0.25, 0.1}};
  const Readings readings = readings_of(chassis, rows_of(chassis, false), increment);
  EXPECT_DOUBLE_EQ(readings.z[0], 1.04 * -0.25);
  EXPECT_DOUBLE_EQ(readings.z[1], 0.93 * 0.1 + 0.03 * -0.25 - 0.004 * 0.5);
  EXPECT_DOUBLE_EQ(readings.variance[0], 4e-4 * 1.04 * 0.25 + 1e-12);
  EXPECT_DOUBLE_EQ(readings.variance[1], 16e-4 * 0.93 * 0.1 + 9e-4 * 1.04 * 0.25 + 1e-18);
}

TEST(Readings, a_velocity_is_read_as_what_it_is_corrected_from) {
  const VelocityCorrection velocity = test::velocity_robot().velocity;
  const ForwardAndTurn read = read_as(velocity, {0.4, -0.2}, 0.3);
  const ForwardAndTurn truth = corrected(velocity, read, 0.3);
  EXPECT_DOUBLE_EQ(truth.forward_m, 0.4);
  EXPECT_DOUBLE_EQ(truth.turn_rad, -0.2);
}

TEST(Chassis, takes_eight_wheels_and_no_more) {
  Chassis chassis;
  for (int i = 0; i < kMaxWheels; ++i) chassis.add({});
  EXPECT_THROW(chassis.add({}), std::length_error);
  EXPECT_EQ(chassis.wheel_count, kMaxWheels);
}

TEST(Chassis, factories_place_wheels_left_to_right_and_front_to_rear) {
  const Chassis chassis = mecanum(kSize, 0.4, 0.5);
  EXPECT_EQ(chassis.wheels()[0].x_m, 0.25);
  EXPECT_EQ(chassis.wheels()[0].y_m, 0.2);
  EXPECT_EQ(chassis.wheels()[1].y_m, -0.2);
  EXPECT_EQ(chassis.wheels()[2].x_m, -0.25);
  EXPECT_EQ(chassis.wheels()[3].ticks_per_revolution, 2048);
}

}  // namespace
}  // namespace trundle::chassis
