// What an Aligner makes of readings does not depend on how they come in, nor on whether it was stored
// meanwhile.
#include "trundle/recording/alignment/aligner.hpp"

#include <cmath>
#include <random>
#include <variant>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/recording/alignment/align.hpp"

#include "recording/robots.hpp"

namespace trundle::recording {
namespace {

using test::stamps;
using test::two_wheels;
using test::wheels;

/// One that wraps, starts again, jumps, misses cells and rows; with a gyro that has gaps.
Recording troubled() {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::vector<double> time_s, left, right;
  double t = 0.0, count = 65'000.0;
  for (int i = 0; i < 4000; ++i) {
    t += i % 700 == 699 ? 3.0 : 0.02 + 0.004 * uniform(random);
    count += 4.0 + 3.0 * std::sin(0.01 * i);
    if (i == 1500) count = 2.0;
    const double read = std::fmod(std::round(count), 65'536.0);
    time_s.push_back(t);
    left.push_back(i % 97 == 50 || (i > 2000 && i < 2040) ? kNotMeasured : read);
    right.push_back(i == 3000 ? std::fmod(read + 30'000.0, 65'536.0) : read);
  }
  Recording recording = wheels(time_s, left, right);
  for (double s = -0.3; s < t + 1.0; s += 0.0101) {
    if (std::fmod(s, 17.0) > 16.2) continue;
    recording.gyro.time_s.push_back(s);
    recording.gyro.yaw_rate_rad_s.push_back(std::fmod(s, 23.0) < 0.02 ? kNotMeasured : std::sin(s));
  }
  for (double s = 0.1; s < t; s += 0.0053) {
    recording.accel.time_s.push_back(s);
    recording.accel.x_m_s2.push_back(uniform(random));
    recording.accel.y_m_s2.push_back(uniform(random));
  }
  return recording;
}

Robot robot_with_gyro() {
  return test::with_gyro(two_wheels(16), {.time_offset_s = 0.013});
}

using Reading = std::variant<WheelReadings, GyroReading, AccelReading>;
struct Arrival {
  double time_s;
  Reading reading;
};

/// The readings of a recording in the order in which they come, those of the wheels late by so much.
std::vector<Arrival> arrivals(const Recording& recording, double wheels_late_s) {
  std::vector<Arrival> all;
  for (std::size_t i = 0; i < recording.wheels.time_s.size(); ++i) {
    WheelReadings readings{.time_s = recording.wheels.time_s[i]};
    for (std::size_t w = 0; w < 2; ++w) readings.value[w] = recording.wheels.series[w].value[i];
    all.push_back({readings.time_s + wheels_late_s, readings});
  }
  for (std::size_t i = 0; i < recording.gyro.time_s.size(); ++i)
    all.push_back(
        {recording.gyro.time_s[i], GyroReading{recording.gyro.time_s[i], recording.gyro.yaw_rate_rad_s[i]}});
  const AccelStream& accel = recording.accel;
  for (std::size_t i = 0; i < accel.time_s.size(); ++i)
    all.push_back({accel.time_s[i], AccelReading{accel.time_s[i], accel.x_m_s2[i], accel.y_m_s2[i]}});
  std::ranges::stable_sort(all, {}, &Arrival::time_s);
  return all;
}

std::vector<AlignedInterval> intervals_of(const std::vector<Arrival>& arrivals, Aligner aligner) {
  std::vector<AlignedInterval> intervals;
  const auto take = [&] {
    while (const auto interval = aligner.next()) intervals.push_back(*interval);
  };
  for (const Arrival& arrival : arrivals) {
    std::visit([&](const auto& reading) { aligner.add(reading); }, arrival.reading);
    take();
  }
  aligner.finish();
  take();
  return intervals;
}

Aligner aligner_of_counts(const Robot& robot) {
  Aligner aligner(robot);
  aligner.set_units({});
  return aligner;
}

void expect_same(const Increment& a, const Increment& b) {
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.duration_s, b.duration_s);
  EXPECT_EQ(a.turned, b.turned);
  EXPECT_EQ(a.has_gyro, b.has_gyro);
  EXPECT_EQ(a.gyro_rad, b.gyro_rad);
  EXPECT_EQ(a.gyro_change_rad_s, b.gyro_change_rad_s);
}

TEST(Aligner, GivesWhatTheWholeRecordingGives) {
  const Recording recording = troubled();
  const Robot robot = robot_with_gyro();
  const AlignedReadings whole = align(recording, robot);
  EXPECT_THAT(whole.findings, testing::Contains(testing::Field(&Finding::code, FindingCode::counter_reset)));
  EXPECT_THAT(whole.findings, testing::Contains(testing::Field(&Finding::code, FindingCode::counter_jump)));
  for (const double wheels_late_s : {0.0, 0.015, 0.1}) {
    SCOPED_TRACE(wheels_late_s);
    const auto intervals = intervals_of(arrivals(recording, wheels_late_s), aligner_of_counts(robot));
    ASSERT_EQ(intervals.size(), whole.increments.size());
    for (std::size_t i = 0; i < intervals.size(); ++i) {
      SCOPED_TRACE(i);
      expect_same(intervals[i].increment, whole.increments[i]);
      EXPECT_EQ(intervals[i].bridged, whole.bridged[i]);
      if (::testing::Test::HasFailure()) return;
    }
  }
}

TEST(Aligner, GoesOnFromItsStateAtAnyReading) {
  const Robot robot = robot_with_gyro();
  const std::vector<Arrival> all = arrivals(troubled(), 0.02);
  const std::vector<AlignedInterval> expected = intervals_of(all, aligner_of_counts(robot));
  Aligner aligner = aligner_of_counts(robot);
  std::size_t next = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::visit([&](const auto& reading) { aligner.add(reading); }, all[i].reading);
    if (i % 13 == 0) {
      Aligner resumed(robot);
      resume_state(resumed, state_of(aligner));
      ASSERT_EQ(state_of(resumed), state_of(aligner));
      aligner = resumed;
    }
    while (const auto interval = aligner.next()) expect_same(interval->increment, expected[next++].increment);
    ASSERT_FALSE(::testing::Test::HasFailure()) << i;
  }
}

TEST(Aligner, SlowSensorsHaveNoGaps) {
  const Robot robot = test::with_gyro(two_wheels());
  Recording recording = wheels(stamps(60, 2.0), std::vector<double>(60), std::vector<double>(60));
  recording.gyro.time_s = stamps(60, 2.0);
  recording.gyro.yaw_rate_rad_s.assign(60, 0.1);
  const AlignedReadings readings = align(recording, robot);
  EXPECT_THAT(readings.bridged, testing::Each(false));
  for (const Increment& increment : readings.increments) EXPECT_TRUE(increment.has_gyro);
}

/// A counter of 1000 counts/m that starts again after so many rows of 0.02 s at 0.3 m/s.
TEST(Aligner, ACounterThatStartsAgainIsFoundAtAnyTime) {
  for (const int row : {3, 20, 100, 1000}) {
    std::vector<double> count;
    for (int i = 0; i < row + 20; ++i) count.push_back(i < row ? 50'000.0 + 6.0 * i : 6.0 * (i - row));
    Robot robot = two_wheels();
    for (Wheel& wheel : robot.chassis.wheels()) wheel.diameter_m = 0.1 / kPi;
    const AlignedReadings readings = align(wheels(stamps(count.size(), 0.02), count, count), robot);
    ASSERT_EQ(readings.findings.size(), 2U) << row;
    EXPECT_EQ(readings.findings.front().code, FindingCode::counter_reset);
    EXPECT_TRUE(readings.bridged[static_cast<std::size_t>(row - 1)]);
    EXPECT_NEAR(readings.increments[static_cast<std::size_t>(row - 1)].turned[0], 0.06, 1e-12);
  }
}

/// What waits is bounded: a wheel that falls silent is not waited for.
TEST(Aligner, AWheelThatFallsSilentHoldsNothingUpForLong) {
  Aligner aligner = aligner_of_counts(two_wheels());
  for (int i = 0; i < 10'000; ++i) {
    WheelReadings readings{.time_s = 0.02 * i};
    readings.value = {i < 50 ? 1.0 * i : kNotMeasured, 1.0 * i};
    aligner.add(readings);
    while (aligner.next()) {
    }
  }
  EXPECT_LT(state_of(aligner).size(), 10'000U);
}

}  // namespace
}  // namespace trundle::recording
