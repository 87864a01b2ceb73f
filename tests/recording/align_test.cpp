#include "trundle/recording/alignment/align.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/trajectory_file.hpp"

#include "recording/robots.hpp"

namespace trundle::recording {
namespace {

using test::stamps;
using test::two_wheels;
using test::wheels;
using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

double sum(const AlignedReadings& readings, std::size_t wheel) {
  double total = 0.0;
  for (const Increment& increment : readings.increments) total += increment.turned[wheel];
  return total;
}

std::vector<double> turned(const AlignedReadings& readings, std::size_t wheel) {
  std::vector<double> values;
  for (const Increment& increment : readings.increments) values.push_back(increment.turned[wheel]);
  return values;
}

std::size_t count_of(const std::vector<Finding>& problems, FindingCode code) {
  std::size_t count = 0;
  for (const Finding& problem : problems)
    if (problem.code == code) count += problem.count;
  return count;
}

TEST(Align, turns_counts_into_revolutions_on_the_wheels_time_base) {
  const AlignedReadings readings = align(wheels({1.0, 1.5, 1.75}, {7, 57, 32}, {0, 100, 200}), two_wheels());
  EXPECT_EQ(readings.start_s, 1.0);
  ASSERT_THAT(readings.increments, SizeIs(2));
  EXPECT_EQ(readings.increments[0].time_s, 1.5);
  EXPECT_EQ(readings.increments[0].duration_s, 0.5);
  EXPECT_EQ(readings.increments[0].turned[0], 0.5);
  EXPECT_EQ(readings.increments[1].turned[0], -0.25);
  EXPECT_EQ(readings.increments[1].turned[1], 1.0);
  EXPECT_FALSE(readings.increments[0].has_gyro);
  EXPECT_THAT(readings.bridged, Each(false));
}

TEST(Align, negative_ticks_per_revolution_count_backwards) {
  Robot robot = two_wheels();
  robot.chassis.wheels()[1].ticks_per_revolution = -100.0;
  const AlignedReadings readings = align(wheels(stamps(2, 0.1), {0, 10}, {0, -10}), robot);
  EXPECT_EQ(readings.increments[0].turned[0], 0.1);
  EXPECT_EQ(readings.increments[0].turned[1], 0.1);
}

/// A counter of some bits, signed or not, that counts `step` more in each row.
class Wrap : public testing::TestWithParam<std::tuple<int, bool, double>> {};

TEST_P(Wrap, is_undone) {
  const auto [bits, is_signed, step] = GetParam();
  const double range = std::ldexp(1.0, bits);
  std::vector<double> count;
  for (int i = 0; i < 200; ++i) {
    double value = std::fmod(1000.0 + i * step, range);
    if (value < 0.0) value += range;
    if (is_signed && value >= range / 2.0) value -= range;
    count.push_back(value);
  }
  const AlignedReadings readings = align(wheels(stamps(200, 0.02), count, count), two_wheels(bits));
  for (const Increment& increment : readings.increments) EXPECT_EQ(increment.turned[0], step / 100.0);
  EXPECT_THAT(readings.bridged, Each(false));
  const bool wraps = std::adjacent_find(count.begin(), count.end(), [by = step](double a, double b) {
                       return b - a != by;
                     }) != count.end();
  EXPECT_EQ(count_of(readings.findings, FindingCode::wrap) > 0, wraps);
  EXPECT_THAT(readings.findings, Each(Field(&Finding::severity, Severity::note)));
}

INSTANTIATE_TEST_SUITE_P(Bits, Wrap,
                         testing::Combine(testing::Values(8, 12, 16, 24, 32), testing::Bool(),
                                          testing::Values(50.0, -50.0, 120.0, -1.0)));

TEST(Align, sixteen_bits_unwrap_where_a_row_is_missing) {
  // 7000 counts a row: across a missing row 14000, and the counter wraps right there.
  const AlignedReadings readings =
      align(wheels({0, 0.1, 0.3, 0.4}, {46000, 53000, 1464, 8464}, {0, 1, 2, 3}), two_wheels(16));
  EXPECT_THAT(turned(readings, 0), testing::ElementsAre(70.0, 140.0, 70.0));
}

TEST(Align, metres_use_the_diameter_they_were_recorded_with) {
  Robot robot = two_wheels();
  robot.chassis.wheels()[0].recorded_diameter_m = 2.0 / kPi;
  const AlignedReadings readings = align(wheels(stamps(2, 0.1), {1, 2}, {1, 2}, WheelUnit::metres), robot);
  EXPECT_DOUBLE_EQ(readings.increments[0].turned[0], 0.5);
  EXPECT_DOUBLE_EQ(readings.increments[0].turned[1], 1.0);
}

TEST(Align, rates_are_the_mean_since_the_row_before) {
  const AlignedReadings readings =
      align(wheels({0, 0.5, 1.5}, {99, 2.0 * kPi, kPi}, {99, 0, 0}, WheelUnit::rate), two_wheels());
  EXPECT_NEAR(readings.increments[0].turned[0], 0.5, 1e-15);
  EXPECT_NEAR(readings.increments[1].turned[0], 0.5, 1e-15);
}

TEST(Align, radians_are_cumulative_angles) {
  const AlignedReadings readings =
      align(wheels(stamps(2, 0.1), {1, 1 + kPi}, {0, 0}, WheelUnit::radians), two_wheels());
  EXPECT_NEAR(readings.increments[0].turned[0], 0.5, 1e-15);
}

TEST(Align, a_gap_is_bridged_its_travel_kept) {
  std::vector<double> time_s = stamps(20, 0.1);
  for (std::size_t i = 10; i < 20; ++i) time_s[i] += 3.0;
  std::vector<double> count(20);
  std::iota(count.begin(), count.end(), 0.0);
  count[10] += 50;
  for (std::size_t i = 11; i < 20; ++i) count[i] += 50;
  const AlignedReadings readings = align(wheels(time_s, count, count), two_wheels());
  EXPECT_EQ(std::count(readings.bridged.begin(), readings.bridged.end(), true), 1);
  EXPECT_TRUE(readings.bridged[9]);
  EXPECT_EQ(readings.increments[9].turned[0], 0.51);
  EXPECT_NEAR(readings.increments[9].duration_s, 3.1, 1e-12);
}

/// 2 counts a row, but from `row` on the counter is elsewhere.
std::vector<double> counts_with(std::size_t row, double offset) {
  std::vector<double> count(100);
  for (std::size_t i = 0; i < 100; ++i)
    count[i] = 5000.0 + 2.0 * static_cast<double>(i) + (i >= row ? offset : 0.0);
  return count;
}

TEST(Align, a_counter_reset_is_never_travel) {
  for (const int bits : {0, 16, 32}) {
    const AlignedReadings readings =
        align(wheels(stamps(100, 0.02), counts_with(60, -5120), counts_with(100, 0)), two_wheels(bits));
    EXPECT_EQ(count_of(readings.findings, FindingCode::counter_reset), 1);
    EXPECT_TRUE(readings.bridged[59]);
    EXPECT_EQ(std::count(readings.bridged.begin(), readings.bridged.end(), true), 1);
    EXPECT_NEAR(sum(readings, 0), 99 * 0.02, 1e-12);
    EXPECT_NEAR(sum(readings, 1), 99 * 0.02, 1e-12);
  }
}

TEST(Align, a_counter_that_jumps_and_returns_is_no_travel) {
  std::vector<double> count = counts_with(100, 0);
  count[40] = 900000.0;
  const AlignedReadings readings = align(wheels(stamps(100, 0.02), count, counts_with(100, 0)), two_wheels());
  EXPECT_EQ(count_of(readings.findings, FindingCode::counter_jump), 2);
  EXPECT_NEAR(sum(readings, 0), 99 * 0.02, 1e-12);
}

TEST(Align, a_first_count_that_is_none_is_no_travel) {
  for (const int bits : {0, 16}) {
    std::vector<double> count = counts_with(100, 0);
    count[0] = 1e6;
    const AlignedReadings readings =
        align(wheels(stamps(100, 0.02), count, counts_with(100, 0)), two_wheels(bits));
    EXPECT_EQ(count_of(readings.findings, FindingCode::counter_reset) +
                  count_of(readings.findings, FindingCode::counter_jump),
              1);
    EXPECT_NEAR(sum(readings, 0), sum(readings, 1), 0.02);
  }
}

TEST(Align, fast_driving_after_slow_is_no_jump) {
  std::vector<double> count = {0};
  for (int i = 1; i < 300; ++i) count.push_back(count.back() + (i < 200 ? i % 2 : 60));
  const AlignedReadings readings = align(wheels(stamps(300, 0.02), count, count), two_wheels());
  EXPECT_THAT(readings.findings, IsEmpty());
  EXPECT_NEAR(sum(readings, 0), count.back() / 100.0, 1e-12);
}

TEST(Align, a_short_burst_of_speed_after_creeping_is_travel) {
  std::vector<double> metres = {0};
  for (int i = 1; i < 1000; ++i) metres.push_back(metres.back() + (i >= 500 && i < 505 ? 0.01 : 0.0001));
  const AlignedReadings readings =
      align(wheels(stamps(1000, 0.02), metres, metres, WheelUnit::metres), two_wheels());
  EXPECT_THAT(readings.findings, IsEmpty());
  EXPECT_NEAR(sum(readings, 0), metres.back(), 1e-12);
}

TEST(Align, empty_cells_are_filled_between_neighbours_and_not_across_gaps) {
  const double nan = kNotMeasured;
  const AlignedReadings filled =
      align(wheels(stamps(5, 0.1), {0, nan, 20, 30, 40}, {0, 10, 20, nan, 40}), two_wheels());
  ASSERT_THAT(filled.increments, SizeIs(4));
  EXPECT_NEAR(filled.increments[0].turned[0], 0.1, 1e-12);
  EXPECT_NEAR(filled.increments[3].turned[1], 0.1, 1e-12);
  std::vector<double> left(30, nan);
  left[0] = 0;
  left[29] = 290;
  std::vector<double> right(30);
  std::iota(right.begin(), right.end(), 0.0);
  const AlignedReadings across = align(wheels(stamps(30, 0.1), left, right), two_wheels());
  ASSERT_THAT(across.increments, SizeIs(1));
  EXPECT_TRUE(across.bridged[0]);
  EXPECT_NEAR(across.increments[0].turned[0], 2.9, 1e-12);
}

Recording turning(double gyro_offset_s) {
  Recording recording = wheels(stamps(51, 0.02), std::vector<double>(51, 0.0), std::vector<double>(51, 0.0));
  // Rate 2 t; the mean over (t − 0.01, t] is 2 t − 0.01. Stamps are late by the offset.
  for (int i = 0; i <= 110; ++i) {
    const double t = 0.01 * i - 0.05;
    recording.gyro.time_s.push_back(t - gyro_offset_s);
    recording.gyro.yaw_rate_rad_s.push_back(2.0 * t - 0.01);
  }
  return recording;
}

TEST(Align, integrates_the_gyro_to_the_wheels_stamps) {
  for (const double offset_s : {0.0, 0.3, -0.2}) {
    Gyro gyro;
    gyro.time_offset_s = offset_s;
    const AlignedReadings readings = align(turning(offset_s), test::with_gyro(two_wheels(), gyro));
    for (const Increment& increment : readings.increments) {
      ASSERT_TRUE(increment.has_gyro);
      const double start_s = increment.time_s - increment.duration_s;
      EXPECT_NEAR(increment.gyro_rad, increment.time_s * increment.time_s - start_s * start_s, 1e-12);
    }
  }
}

TEST(Align, interpolates_the_integral_of_the_gyro_between_its_stamps) {
  Recording recording = wheels({0.0, 0.005, 0.02}, {0, 0, 0}, {0, 0, 0});
  recording.gyro.time_s = {0.0, 0.01, 0.02};
  recording.gyro.yaw_rate_rad_s = {0.0, 1.0, 3.0};
  const AlignedReadings readings = align(recording, test::with_gyro(two_wheels()));
  EXPECT_NEAR(readings.increments[0].gyro_rad, 0.005, 1e-15);
  EXPECT_NEAR(readings.increments[1].gyro_rad, 0.035, 1e-15);
}

TEST(Align, wheels_time_offset_moves_the_time_base) {
  Robot robot = test::with_gyro(two_wheels());
  robot.chassis.wheels_time_offset_s = 0.25;
  const AlignedReadings readings = align(turning(0.0), robot);
  EXPECT_EQ(readings.start_s, 0.25);
  const Increment& increment = readings.increments[10];
  EXPECT_NEAR(increment.time_s, 0.47, 1e-12);
  EXPECT_NEAR(increment.gyro_rad, 0.47 * 0.47 - 0.45 * 0.45, 1e-12);
}

TEST(Align, has_no_gyro_where_the_gyro_has_a_gap_is_empty_saturated_or_absent) {
  const auto with = [](auto change) {
    Recording recording = turning(0.0);
    change(recording.gyro);
    return align(recording, test::with_gyro(two_wheels()));
  };
  const AlignedReadings gap = with([](GyroStream& gyro) {
    for (double& time : gyro.time_s) time += time > 0.5 ? 0.51 : 0.0;
    gyro.time_s.resize(80);
    gyro.yaw_rate_rad_s.resize(80);
  });
  EXPECT_TRUE(gap.increments[24].has_gyro);
  EXPECT_FALSE(gap.increments[25].has_gyro);
  EXPECT_FALSE(gap.increments[49].has_gyro);
  EXPECT_EQ(count_of(gap.findings, FindingCode::gyro_missing), 25);
  // Row 55 is stamped 0.5: the step from 0.49 is lost, that is the wheels' interval from 0.48 to 0.50.
  const AlignedReadings empty = with([](GyroStream& gyro) { gyro.yaw_rate_rad_s[55] = kNotMeasured; });
  const AlignedReadings saturated = with([](GyroStream& gyro) { gyro.yaw_rate_rad_s[55] = -8.7; });
  for (const AlignedReadings& readings : {empty, saturated})
    for (std::size_t i = 0; i < 50; ++i) EXPECT_EQ(readings.increments[i].has_gyro, i != 24) << i;
  EXPECT_EQ(count_of(saturated.findings, FindingCode::gyro_saturated), 1);
  const AlignedReadings late = with([](GyroStream& gyro) {
    for (double& time : gyro.time_s) time += 0.2;
  });
  EXPECT_FALSE(late.increments[5].has_gyro);
  EXPECT_TRUE(late.increments[10].has_gyro);
}

TEST(Align, a_gyro_reaches_one_sample_beyond_its_ends) {
  Recording recording = wheels(stamps(11, 0.1), std::vector<double>(11, 0.0), std::vector<double>(11, 0.0));
  recording.gyro.time_s = stamps(100, 0.01);  // ends at 0.99
  recording.gyro.yaw_rate_rad_s.assign(100, 2.0);
  const AlignedReadings readings = align(recording, test::with_gyro(two_wheels()));
  EXPECT_TRUE(readings.increments.back().has_gyro);
  EXPECT_NEAR(readings.increments.back().gyro_rad, 0.2, 1e-12);
}

TEST(Align, a_robot_without_wheels_takes_the_velocity_stream) {
  Recording recording;
  recording.velocity = {{0, 0.5, 1.0, 3.0}, {9, 1, 2, 3}, {9, 0.5, 0.25, -1}};
  Robot robot;
  const AlignedReadings readings = align(recording, robot);
  ASSERT_THAT(readings.increments, SizeIs(3));
  EXPECT_DOUBLE_EQ(readings.increments[0].turned[0], 0.5);
  EXPECT_DOUBLE_EQ(readings.increments[0].turned[1], 0.25);
  EXPECT_DOUBLE_EQ(readings.increments[1].turned[0], 1.0);
  EXPECT_DOUBLE_EQ(readings.increments[2].turned[1], -2.0);
}

TEST(Align, refuses_a_recording_that_lacks_what_the_robot_needs) {
  const auto refused = [](const Recording& recording, const Robot& robot, const char* fact) {
    try {
      align(recording, robot);
      FAIL() << fact;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(fact));
      EXPECT_THAT(error.what(), HasSubstr("; expected "));
    }
  };
  Recording one = wheels({0, 1}, {0, 1}, {0, 1});
  one.wheels.series.pop_back();
  refused(one, two_wheels(), "has no column of the wheel 'right'");
  refused(Recording{}, two_wheels(), "has no wheels.csv");
  refused(Recording{}, Robot{}, "says nothing of how the robot moved");
  Robot uncounted = two_wheels();
  uncounted.chassis.wheels()[0].ticks_per_revolution = 0.0;
  refused(wheels({0, 1}, {0, 1}, {0, 1}), uncounted, "has no ticks_per_revolution");
}

TEST(ReferenceTrajectory, keeps_complete_poses_alone) {
  Recording recording;
  recording.reference = {{0, 1, 2}, {1, kNotMeasured, 3}, {4, 5, 6}, {0.1, 0.2, 0.3}};
  const Trajectory trajectory = reference_trajectory(recording);
  ASSERT_THAT(trajectory.poses, SizeIs(2));
  EXPECT_EQ(trajectory.poses[1].time_s, 2.0);
  EXPECT_EQ(trajectory.poses[1].pose.x, 3.0);
  EXPECT_FALSE(trajectory.has_covariance());
}

Recording turning_to_and_fro(double step_s) {
  Recording recording = wheels(stamps(41, step_s), std::vector<double>(41), std::vector<double>(41));
  recording.gyro.time_s = stamps(250, 0.01);
  for (double& t : recording.gyro.time_s) t -= 0.2;
  for (const double t : recording.gyro.time_s)
    recording.gyro.yaw_rate_rad_s.push_back(0.3 + std::sin(3.0 * t) + 0.2 * std::cos(11.0 * t));
  return recording;
}

AlignedReadings with_clock(const Recording& recording, double time_offset_s) {
  return align(recording, test::with_gyro(two_wheels(), {.time_offset_s = time_offset_s}));
}

// −∂(what the gyro turns)/∂(its time offset), by differences of the alignment itself: backwards, for nobody
// knows what comes.
TEST(Align, the_change_of_rate_is_what_a_moved_clock_changes) {
  constexpr double kMoved_s = 0.1;
  const Recording recording = turning_to_and_fro(0.05);
  const Increments here = with_clock(recording, 0.01).increments;
  const Increments later = with_clock(recording, 0.01 + kMoved_s).increments;
  for (std::size_t i = 0; i < here.size(); ++i)
    EXPECT_NEAR(here[i].gyro_change_rad_s, -(later[i].gyro_rad - here[i].gyro_rad) / kMoved_s, 1e-9) << i;
}

TEST(Align, the_centred_change_of_rate_is_what_a_moved_clock_changes_either_way) {
  constexpr double kStep_s = 0.05;
  constexpr double kMoved_s = 2.0 * kStep_s;
  const Recording recording = turning_to_and_fro(kStep_s);
  AlignedReadings here = with_clock(recording, 0.01);
  centre_gyro_changes(here);
  const Increments later = with_clock(recording, 0.01 + kMoved_s).increments;
  const Increments earlier = with_clock(recording, 0.01 - kMoved_s).increments;
  for (std::size_t i = 2; i + 2 < here.increments.size(); ++i)
    EXPECT_NEAR(here.increments[i].gyro_change_rad_s,
                -(later[i].gyro_rad - earlier[i].gyro_rad) / (2.0 * kMoved_s), 1e-9)
        << i;
  EXPECT_EQ(here.increments.front().gyro_change_rad_s, 0.0);  // nothing is known before it
}

TEST(Align, a_gyro_with_another_clock_is_integrated_anew) {
  const Recording recording = turning_to_and_fro(0.03);
  AlignedReadings moved = with_clock(recording, 0.0);
  add_gyro(recording.gyro, test::with_gyro(two_wheels(), {.time_offset_s = 0.123}), moved);
  const AlignedReadings expected = with_clock(recording, 0.123);
  for (std::size_t i = 0; i < moved.increments.size(); ++i) {
    EXPECT_EQ(moved.increments[i].has_gyro, expected.increments[i].has_gyro) << i;
    EXPECT_EQ(moved.increments[i].gyro_rad, expected.increments[i].gyro_rad) << i;
  }
}

}  // namespace
}  // namespace trundle::recording
