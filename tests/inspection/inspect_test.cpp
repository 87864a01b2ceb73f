#include "trundle/inspection/inspect.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/odometry/gyro_noise.hpp"

#include "recording/findings.hpp"
#include "recording/robots.hpp"

namespace trundle::inspection {
namespace {

using test::stamps;
using test::two_wheels;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// 20 s at 20 Hz on a winding way, in ticks; the gyro tells the turn.
Recording winding(double gyro_sign = 1.0) {
  Recording recording = test::wheels(stamps(401, 0.05), {0}, {0});
  std::vector<double>& left = recording.wheels.series[0].value;
  std::vector<double>& right = recording.wheels.series[1].value;
  recording.gyro = {{0.0}, {0.0}};
  double l = 0.0, r = 0.0;
  for (int i = 1; i <= 400; ++i) {
    const double turn_rate = std::sin(0.02 * i);
    l += (0.3 - 0.25 * turn_rate) * 0.05 * 100.0;
    r += (0.3 + 0.25 * turn_rate) * 0.05 * 100.0;
    left.push_back(std::round(l));
    right.push_back(std::round(r));
    recording.gyro.time_s.push_back(0.05 * i);
    recording.gyro.yaw_rate_rad_s.push_back(gyro_sign * turn_rate);
  }
  return recording;
}

std::vector<Finding> inspected(const Recording& recording, const Robot& robot) {
  return inspect(recording, robot, overview_of(recording, robot));
}

void freeze(Recording& recording, std::size_t wheel, std::size_t from, std::size_t to) {
  auto& value = recording.wheels.series[wheel].value;
  const double lost = value[to] - value[from];
  for (std::size_t i = from; i < value.size(); ++i) value[i] = i < to ? value[from] : value[i] - lost;
}

TEST(Inspect, more_columns_than_a_robot_has_wheels_do_no_harm) {
  Recording recording = winding();
  auto& series = recording.wheels.series;
  for (int i = 0; i < kMaxWheels; ++i) series.insert(series.begin(), series.back());
  for (int i = 0; i < kMaxWheels; ++i)
    series[static_cast<std::size_t>(i)].wheel = "other_" + std::to_string(i);
  EXPECT_THAT(inspected(recording, two_wheels()), IsEmpty());
  EXPECT_THAT(inspect(recording), IsEmpty());
}

TEST(Inspect, a_good_log_has_no_problems) {
  EXPECT_THAT(inspect(winding()), IsEmpty());
  EXPECT_THAT(inspected(winding(), two_wheels()), IsEmpty());
  EXPECT_THAT(inspected(winding(), test::with_gyro(two_wheels())), IsEmpty());
}

TEST(Inspect, names_a_stuck_encoder) {
  for (const std::size_t wheel : {0U, 1U}) {
    const char* name = wheel == 0 ? "'left'" : "'right'";
    for (const auto& [from, to] : {std::pair<std::size_t, std::size_t>{100, 250}, {0, 400}}) {
      Recording recording = winding();
      freeze(recording, wheel, from, to);
      EXPECT_THAT(inspect(recording), Contains(test::finding(FindingCode::stuck_encoder, name))) << from;
      EXPECT_THAT(inspected(recording, two_wheels()),
                  Contains(test::finding(FindingCode::stuck_encoder, name)))
          << from;
      EXPECT_THAT(inspected(recording, test::with_gyro(two_wheels())),
                  Contains(test::finding(FindingCode::stuck_encoder, name)))
          << from;
    }
  }
}

TEST(Inspect, a_pivot_about_one_wheel_is_no_stuck_encoder_when_the_gyro_sees_it) {
  Recording recording = test::wheels(stamps(201, 0.05), std::vector<double>(201, 0.0), {0});
  recording.gyro = {stamps(201, 0.05), std::vector<double>(201, 0.4)};
  double right = 0.0;
  for (int i = 1; i <= 200; ++i) {
    right += 0.4 * 0.5 * 0.05 * 100.0;
    recording.wheels.series[1].value.push_back(std::round(right));
  }
  EXPECT_THAT(inspected(recording, test::with_gyro(two_wheels())), IsEmpty());
  EXPECT_THAT(inspected(recording, two_wheels()),
              Contains(test::finding(FindingCode::stuck_encoder, "or the robot pivots on this wheel")));
}

TEST(Inspect, an_omni_wheel_that_is_pushed_along_its_rollers_is_no_stuck_encoder) {
  Robot robot;
  robot.wheel_names = {"left", "right", "back"};
  robot.chassis = omni3({0.1, 1000.0, 0}, 0.2);  // along one wheel's axle: it stands, the others turn alike
  std::size_t standing = robot.chassis.wheels().size();
  Recording recording;
  recording.wheels.time_s = stamps(201, 0.05);
  for (std::size_t w = 0; w < robot.wheel_names.size(); ++w) {
    const double share = std::cos(robot.chassis.wheels()[w].direction_rad);
    if (std::abs(share) < 1e-9) standing = w;
    recording.wheels.series.push_back({robot.wheel_names[w], WheelUnit::ticks, {}});
    for (int i = 0; i <= 200; ++i) recording.wheels.series[w].value.push_back(std::round(50.0 * share * i));
  }
  ASSERT_LT(standing, robot.chassis.wheels().size());
  EXPECT_THAT(inspected(recording, robot), IsEmpty());
}

TEST(Inspect, standing_still_is_no_stuck_encoder) {
  Recording recording = winding();
  freeze(recording, 0, 100, 200);
  freeze(recording, 1, 100, 200);
  std::fill_n(recording.gyro.yaw_rate_rad_s.begin() + 101, 100, 0.0);
  EXPECT_THAT(inspect(recording), IsEmpty());
  EXPECT_THAT(inspected(recording, test::with_gyro(two_wheels())), IsEmpty());
}

TEST(Inspect, names_a_gyro_that_turns_the_other_way) {
  EXPECT_THAT(inspected(winding(-1.0), test::with_gyro(two_wheels())),
              Contains(test::finding(FindingCode::gyro_sign, "the other way")));
  Gyro upside_down;
  upside_down.scale = -1.0;
  EXPECT_THAT(inspected(winding(-1.0), test::with_gyro(two_wheels(), upside_down)), IsEmpty());
}

TEST(Inspect, names_a_gyro_in_degrees) {
  Gyro fast;
  fast.max_rate_rad_s = 1000.0;
  EXPECT_THAT(inspected(winding(57.3), test::with_gyro(two_wheels(), fast)),
              Contains(test::finding(FindingCode::gyro_unit, "degrees per second")));
}

TEST(Inspect, guesses_the_bits_of_a_counter) {
  Recording recording = winding();
  for (double& value : recording.wheels.series[0].value) value = std::fmod(value + 65400.0, 65536.0);
  EXPECT_THAT(inspect(recording), Contains(test::finding(FindingCode::wrap, "tick_bits = 16")));
}

TEST(Inspect, finds_a_counter_reset_without_knowing_the_robot) {
  Recording recording = winding();
  auto& left = recording.wheels.series[0].value;
  for (double& value : left) value += 3000.0;
  const double lost = left[300];
  for (std::size_t i = 300; i < left.size(); ++i) left[i] -= lost;
  EXPECT_THAT(inspect(recording), Contains(test::finding(FindingCode::counter_reset, "'left'")));
}

/// Of two wheels, read 20 times a second.
std::vector<Finding> found_in(const std::vector<double>& left, const std::vector<double>& right) {
  const Robot robot = test::two_wheels();
  const Recording recording = test::wheels(test::stamps(static_cast<int>(left.size()), 0.05), left, right);
  return inspect(recording, robot, overview_of(recording, robot));
}

std::vector<double> column(int rows, double step, double first = 0.0) {
  std::vector<double> values;
  for (int row = 0; row < rows; ++row) values.push_back(step * row + first);
  return values;
}

auto is_about(FindingCode code) {
  return Contains(testing::Field(&Finding::code, code));
}

TEST(Inspect, names_counts_that_hold_fractions_and_hardly_turn_the_wheel) {
  EXPECT_THAT(found_in(column(40, 7.0), column(40, 0.01, 0.0003)),
              Contains(test::finding(FindingCode::fractions, "right_ticks holds fractions, like 0.0003")));
  EXPECT_THAT(found_in(column(40, 7.0), column(40, 7.0, 0.5)), Not(is_about(FindingCode::fractions)));
}

TEST(Inspect, names_counts_that_change_by_parts_of_a_count) {
  EXPECT_THAT(found_in(column(4000, 7.0), column(4000, 7.3)),
              Contains(test::finding(FindingCode::finer_than_counts,
                                     "right_ticks changes by parts of a count, like 7.3")));
  EXPECT_THAT(found_in(column(4000, 7.0), column(4000, 7.0, 0.5)),
              Not(is_about(FindingCode::finer_than_counts)));
}

TEST(Misreading, is_a_column_a_unit_or_a_clock_taken_for_another) {
  EXPECT_TRUE(is_misreading({.code = FindingCode::increments}));
  EXPECT_TRUE(is_misreading({.code = FindingCode::not_increments}));
  EXPECT_FALSE(is_misreading({.code = FindingCode::gap}));
}

TEST(Summaries, tell_rows_rates_and_gaps) {
  Recording recording = winding();
  recording.gyro.time_s.back() += 5.0;
  const std::vector<StreamSummary> streams = summaries_of(recording);
  ASSERT_EQ(streams.size(), 2U);
  EXPECT_EQ(streams[0].stream, "wheels");
  EXPECT_THAT(streams[0].columns, testing::ElementsAre("left_ticks", "right_ticks"));
  EXPECT_EQ(streams[0].rows, 401U);
  EXPECT_NEAR(streams[0].rate_hz, 20.0, 1e-9);
  EXPECT_EQ(streams[0].gaps, 0U);
  EXPECT_EQ(streams[1].gaps, 1U);
  EXPECT_NEAR(streams[1].longest_step_s, 5.05, 1e-9);
}

TEST(Missing, says_what_to_add) {
  const Recording recording = winding();
  EXPECT_THAT(missing_in(recording, nullptr),
              Contains(AllOf(HasSubstr("a reference"), HasSubstr("distance_m"))));
  const Robot robot = two_wheels();
  EXPECT_THAT(missing_in(recording, &robot), Contains(HasSubstr("[gyro] in the robot file")));
  Robot skid = test::with_gyro(two_wheels());
  for (Wheel& wheel : skid.chassis.wheels()) wheel.kind = WheelKind::skid;
  EXPECT_THAT(missing_in(recording, &skid),
              Contains(AllOf(HasSubstr("the effective track in proportion to the wheel diameters"),
                             HasSubstr("turns"))));
  Recording with_reference = recording;
  with_reference.partial.closed = Measured{0.0, 0.01};
  const Robot with_gyro = test::with_gyro(two_wheels());
  EXPECT_THAT(missing_in(with_reference, &with_gyro), IsEmpty());
  Recording without_right = recording;
  without_right.wheels.series.pop_back();
  EXPECT_THAT(missing_in(without_right, &robot), Contains(HasSubstr("the wheel 'right'")));
}

TEST(Abilities, of_two_wheels_end_where_nothing_checks_them) {
  const Abilities alone = abilities_of(two_wheels(), false);
  EXPECT_THAT(alone.can, Contains(HasSubstr("sideways is taken as zero")));
  EXPECT_THAT(alone.cannot, Contains(HasSubstr("whether a wheel slips")));
  const Abilities checked = abilities_of(test::with_gyro(two_wheels()), true);
  EXPECT_THAT(checked.can, Contains(HasSubstr("1 reading more")));
  EXPECT_THAT(checked.cannot, Contains(HasSubstr("'left' from 'right'")));
  EXPECT_THAT(checked.cannot,
              Contains(HasSubstr("all wheels slipping together as if the robot moved without turning")));
}

TEST(Abilities, of_one_pod_leave_a_motion_unseen) {
  const std::vector<Pod> pods = {{0.0, 0.0, 0.0}};
  Robot robot;
  robot.chassis = dead_wheels({0.1, 100.0, 0}, pods, Gyro{});
  robot.wheel_names = {"pod"};
  EXPECT_THAT(abilities_of(robot, true).cannot, Contains(HasSubstr("sideways motion: no sensor sees it")));
}

TEST(Abilities, say_which_wheels_are_steered_and_which_passive) {
  Robot robot;
  robot.wheel_names = {"front"};
  robot.passive_names = {"rear"};
  robot.chassis = tricycle({.diameter_m = 0.1, .ticks_per_revolution = 1000}, 0.5);
  robot.chassis.gyro.emplace();
  const Abilities abilities = abilities_of(robot, true);
  EXPECT_THAT(abilities.can, Contains("where 'front' points: its steering is read, ± 0.5°"));
  EXPECT_THAT(abilities.cannot, Contains(HasSubstr("how far 'rear' rolls: it is passive")));
  EXPECT_THAT(abilities.can, Contains(HasSubstr("1 reading more than the motion needs")));
  EXPECT_THAT(abilities.cannot, Contains("the travel of 'front' from the angle of 'front': faults of these "
                                         "two cannot be distinguished"));
  EXPECT_THAT(abilities.cannot,
              Contains("straight ahead, an error of the travel of 'front': no other sensor checks it"));
  robot.chassis.gyro.reset();
  EXPECT_THAT(abilities_of(robot, false).cannot,
              Contains("whether a wheel slips: no redundant measurement; a gyro or another wheel with an "
                       "encoder would be one"));
}

TEST(Abilities, of_a_swerve_tell_each_modules_travel_and_angle_apart) {
  Robot robot;
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  robot.chassis = swerve({.diameter_m = 0.1, .ticks_per_revolution = 1000}, 0.4, 0.5);
  const Abilities abilities = abilities_of(robot, false);
  EXPECT_THAT(abilities.can, Contains("the motion: forward, sideways and turning are all measured"));
  EXPECT_THAT(abilities.can, Contains(HasSubstr("5 readings more than the motion needs")));
  EXPECT_THAT(abilities.cannot, testing::Not(Contains(HasSubstr("cannot be distinguished"))));
  EXPECT_THAT(abilities.cannot, testing::Not(Contains(HasSubstr("no other sensor checks it"))));
}

/// A steering that stands at 2°, swings to −30° and through ±180°, while one wheel rolls but for two rows.
TEST(Steerings, are_told_in_degrees_with_range_rate_and_what_they_read_at_rest) {
  Recording recording;
  recording.wheels.time_s = {0.0, 0.1, 0.2, 0.3, 0.4, 0.5};
  recording.wheels.series = {{"w0", WheelUnit::ticks, {0.0, 0.0, 0.0, 5.0, 9.0, 20.0}}};
  const std::vector<double> read_deg = {3.0, 2.0, 2.0, -30.0, -179.0, 179.0};
  WheelSeries steering{"w0", WheelUnit::radians, {}};
  for (const double angle : read_deg) steering.value.push_back(radians(angle));
  steering.value.push_back(kNotMeasured);
  recording.wheels.time_s.push_back(0.6);
  recording.wheels.series[0].value.push_back(30.0);
  recording.wheels.steering = {steering};
  const std::vector<SteeringSummary> told = steerings_of(recording, nullptr);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_FALSE(told[0].in_ticks);
  EXPECT_NEAR(told[0].least, -179.0, 1e-9);
  EXPECT_NEAR(told[0].greatest, 179.0, 1e-9);
  EXPECT_NEAR(told[0].rate_hz, 10.0, 1e-9);
  EXPECT_NEAR(told[0].fastest_per_s, 1490.0, 1e-6);
  ASSERT_TRUE(told[0].at_rest);
  EXPECT_NEAR(*told[0].at_rest, 2.0, 1e-9);
}

TEST(Steerings, in_counts_are_degrees_where_the_robot_file_says_how_many) {
  Recording recording;
  recording.wheels.time_s = {0.0, 0.1};
  recording.wheels.series = {{"w0", WheelUnit::ticks, {0.0, 3.0}}};
  recording.wheels.steering = {{"w0", WheelUnit::ticks, {0.0, 1024.0}}};
  EXPECT_TRUE(steerings_of(recording, nullptr)[0].in_ticks);
  EXPECT_EQ(steerings_of(recording, nullptr)[0].greatest, 1024.0);
  EXPECT_FALSE(steerings_of(recording, nullptr)[0].at_rest);
  Robot robot;
  robot.wheel_names = {"w0"};
  robot.chassis =
      tricycle({.diameter_m = 0.1, .ticks_per_revolution = 1000}, 0.5, {.ticks_per_revolution = 4096.0});
  robot.passive_names = {"rear"};
  const SteeringSummary told = steerings_of(recording, &robot)[0];
  EXPECT_FALSE(told.in_ticks);
  EXPECT_NEAR(told.greatest, 90.0, 1e-9);
}

TEST(GyroNoise, comes_from_where_the_robot_rests) {
  Recording recording = winding();
  EXPECT_FALSE(gyro_noise(recording));
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 0.01);
  Recording resting =
      test::wheels(stamps(1001, 0.1), std::vector<double>(1001, 0.0), std::vector<double>(1001, 0.0));
  resting.gyro.time_s = stamps(10001, 0.01);
  for (std::size_t i = 0; i < 10001; ++i) resting.gyro.yaw_rate_rad_s.push_back(0.05 + noise(random));
  const auto found = gyro_noise(resting);
  ASSERT_TRUE(found);
  // 9960 samples: the mean scatters by 0.01 / √9960, sigma by 0.7 %; five sigmas are allowed.
  EXPECT_NEAR(found->bias_rad_s, 0.05, 5.0 * 0.01 / std::sqrt(9960.0));
  EXPECT_NEAR(found->noise_rad_s_sqrt_hz, 0.01 / std::sqrt(100.0), 5.0 * 0.001 / std::sqrt(2.0 * 9960.0));
  EXPECT_FALSE(found->bias_walk_rad_s_sqrt_s);
}

/// A stamp in whole milliseconds.
TEST(Rate, of_stamps_that_are_rounded_is_that_of_the_stream) {
  Recording recording;
  for (int row = 0; row < 3000; ++row) {
    recording.gyro.time_s.push_back(std::round(1e3 * row / 30.0) / 1e3 + (row < 1500 ? 0.0 : 20.0));
    recording.gyro.yaw_rate_rad_s.push_back(0.0);
  }
  const std::vector<StreamSummary> streams = summaries_of(recording);
  ASSERT_EQ(streams.size(), 1);
  EXPECT_NEAR(streams[0].rate_hz, 30.0, 0.01) << "20 s of a gap are none of it";
  EXPECT_EQ(streams[0].gaps, 1);
}

}  // namespace
}  // namespace trundle::inspection
