// The angles of steered wheels, from their columns to the middle of an interval.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/io/error.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/alignment/aligner.hpp"

#include "recording/folder.hpp"
#include "recording/robots.hpp"

namespace trundle::recording {
namespace {

using test::stamps;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;

/// One steered wheel of circumference 1 m with 100 ticks, and a passive axle.
Robot tricycle_robot(const SteeringSensor& steering = {}) {
  Robot robot;
  robot.name = "tricycle";
  robot.chassis = tricycle({1.0 / kPi, 100.0, 0}, 0.5, steering);
  robot.wheel_names = {"front"};
  robot.passive_names = {"rear"};
  return robot;
}

/// At 10 Hz, ten ticks a step.
Recording driven(std::vector<double> angles, WheelUnit unit = WheelUnit::radians) {
  Recording recording;
  recording.name = "made";
  std::vector<double> ticks;
  for (std::size_t i = 0; i < angles.size(); ++i) ticks.push_back(10.0 * static_cast<double>(i));
  recording.wheels.time_s = stamps(angles.size(), 0.1);
  recording.wheels.series = {{"front", WheelUnit::ticks, ticks}};
  recording.wheels.steering = {{"front", unit, std::move(angles)}};
  return recording;
}

std::vector<double> angles_of(const AlignedReadings& readings) {
  std::vector<double> angles;
  for (const Increment& increment : readings.increments) angles.push_back(increment.steering_rad[0]);
  return angles;
}

std::vector<testing::Matcher<double>> near(const std::vector<double>& expected) {
  std::vector<testing::Matcher<double>> matchers;
  for (const double value : expected) matchers.push_back(DoubleNear(value, 1e-12));
  return matchers;
}

TEST(Steering, is_read_beside_the_wheels) {
  const test::Folder folder;
  folder.write("wheels.csv", "time_s,front_ticks,front_steering_rad\n0,0,0.1\n0.1,10,0.2\n");
  const Recording recording = read_recording(folder.path());
  ASSERT_EQ(recording.wheels.series.size(), 1U);
  ASSERT_EQ(recording.wheels.steering.size(), 1U);
  EXPECT_EQ(recording.wheels.steering[0].wheel, "front");
  EXPECT_EQ(recording.wheels.steering[0].unit, WheelUnit::radians);
  EXPECT_THAT(recording.wheels.steering[0].value, ElementsAre(0.1, 0.2));
}

TEST(Steering, is_written_as_it_was_read) {
  const test::Folder folder;
  Recording recording = driven({0.1, -0.2, 0.3});
  recording.wheels.steering.push_back({"rear", WheelUnit::ticks, {1.0, 2.0, 3.0}});
  write_recording(recording, folder.path());
  const Recording again = read_recording(folder.path());
  ASSERT_EQ(again.wheels.steering.size(), 2U);
  EXPECT_EQ(again.wheels.steering[0].value, recording.wheels.steering[0].value);
  EXPECT_EQ(again.wheels.steering[1].unit, WheelUnit::ticks);
}

TEST(Steering, is_not_summed_up_where_counts_are) {
  const test::Folder folder;
  folder.write("log.csv", "0,0,0.1\n0.1,10,0.2\n0.2,10,0.1\n");
  folder.write(
      "recording.toml",
      "[wheels]\nfile = \"log.csv\"\nheader = false\nincrements = true\n"
      "columns = { time_s = 1, front_ticks = 2, front_steering_rad = { column = 3, unit = \"deg\" } }\n");
  const Recording recording = read_recording(folder.path());
  EXPECT_THAT(recording.wheels.series[0].value, ElementsAre(0, 10, 20));
  EXPECT_THAT(recording.wheels.steering[0].value,
              testing::ElementsAreArray(near({radians(0.1), radians(0.2), radians(0.1)})));
}

TEST(Steering, of_an_interval_is_that_of_its_middle) {
  EXPECT_THAT(angles_of(align(driven({0.0, 0.2, 0.2, -0.1}), tricycle_robot())),
              testing::ElementsAreArray(near({0.1, 0.2, 0.05})));
}

TEST(Steering, has_a_clock_of_its_own) {
  // A reading that belongs to the interval before its stamp: half a step earlier it is the middle's.
  EXPECT_THAT(angles_of(align(driven({0.5, 0.2, 0.3, -0.1}), tricycle_robot({.time_offset_s = -0.05}))),
              testing::ElementsAreArray(near({0.2, 0.3, -0.1})));
  // Readings that come late are waited for; at the end the last one stays.
  EXPECT_THAT(angles_of(align(driven({0.5, 0.2, 0.3, -0.1}), tricycle_robot({.time_offset_s = -0.15}))),
              testing::ElementsAreArray(near({0.3, -0.1, -0.1})));
  // And before the first that one.
  EXPECT_THAT(angles_of(align(driven({0.5, 0.2, 0.3, -0.1}), tricycle_robot({.time_offset_s = 0.05}))),
              testing::ElementsAreArray(near({0.5, 0.2, 0.3})));
}

TEST(Steering, in_counts_is_turned_into_radians) {
  EXPECT_THAT(angles_of(align(driven({0.0, 100.0, 100.0}, WheelUnit::ticks),
                              tricycle_robot({.ticks_per_revolution = -400.0}))),
              testing::ElementsAreArray(near({-0.25 * kPi, -0.5 * kPi})));
}

TEST(Steering, turns_the_short_way_through_half_a_turn) {
  const std::vector<double> angles = angles_of(align(driven({kPi - 0.1, -kPi + 0.1}), tricycle_robot()));
  EXPECT_NEAR(std::cos(angles[0]), -1.0, 1e-12);
}

TEST(Steering, from_0_to_a_turn_is_that_to_both_sides) {
  const std::vector<double> angles = {-0.3, -0.1, 0.1, 0.3, -0.2};
  std::vector<double> from_0 = angles;
  for (double& angle : from_0)
    if (angle < 0.0) angle += 2.0 * kPi;
  const auto both_sides = angles_of(align(driven(angles), tricycle_robot()));
  EXPECT_THAT(angles_of(align(driven(from_0), tricycle_robot())),
              testing::ElementsAreArray(near(both_sides)));
  std::vector<double> ticks;
  for (const double angle : from_0) ticks.push_back(angle / (2.0 * kPi) * 4096.0);
  EXPECT_THAT(
      angles_of(align(driven(ticks, WheelUnit::ticks), tricycle_robot({.ticks_per_revolution = 4096.0}))),
      testing::ElementsAreArray(near(both_sides)));
  // Of one that reads clockwise, and stands at its direction where it reads 350°.
  const SteeringSensor steering{.zero_rad = radians(350.0), .scale = -1.0};
  EXPECT_THAT(angles_of(align(driven({radians(340.0), radians(10.0)}), tricycle_robot(steering))),
              testing::ElementsAreArray(near({radians(355.0)})));
}

TEST(Steering, goes_on_beyond_a_turn) {
  std::vector<double> angles, wrapped;
  for (int i = 0; i < 12; ++i) {
    angles.push_back(0.9 * i);
    wrapped.push_back(wrap_angle(0.9 * i));
  }
  const auto on_and_on = angles_of(align(driven(angles), tricycle_robot()));
  EXPECT_NEAR(on_and_on.back(), 0.9 * 10.5, 1e-12);
  EXPECT_THAT(angles_of(align(driven(wrapped), tricycle_robot())),
              testing::ElementsAreArray(near(on_and_on)));
}

TEST(Steering, of_a_geared_column_is_taken_as_it_is_read) {
  EXPECT_THAT(angles_of(align(driven({4.0, 4.2, 4.0}), tricycle_robot({.scale = 1.0 / 15.0}))),
              testing::ElementsAreArray(near({4.1, 4.1})));
}

TEST(Steering, fills_empty_cells_between_its_neighbours) {
  EXPECT_THAT(angles_of(align(driven({0.0, kNotMeasured, 0.2}), tricycle_robot())),
              testing::ElementsAreArray(near({0.05, 0.15})));
}

TEST(Steering, that_falls_silent_makes_gaps) {
  std::vector<double> angles(40, kNotMeasured);
  angles[0] = 0.1;
  const AlignedReadings readings = align(driven(angles), tricycle_robot());
  ASSERT_EQ(readings.increments.size(), 39U);
  EXPECT_FALSE(readings.bridged[0]);
  EXPECT_TRUE(readings.bridged[38]);
  for (const Increment& increment : readings.increments) EXPECT_EQ(increment.steering_rad[0], 0.1);
}

TEST(Steering, that_was_never_read_is_known_nowhere) {
  const AlignedReadings readings = align(driven(std::vector<double>(40, kNotMeasured)), tricycle_robot());
  ASSERT_EQ(readings.increments.size(), 39U);
  EXPECT_THAT(readings.bridged, testing::Each(true));
}

std::string refusal_to_align(const Recording& recording, const Robot& robot) {
  try {
    align(recording, robot);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(Steering, is_asked_for_by_the_name_of_its_column) {
  Recording recording = driven({0.0, 0.1});
  recording.wheels.steering.clear();
  EXPECT_THAT(
      refusal_to_align(recording, tricycle_robot()),
      testing::AllOf(HasSubstr("no column of the steering of 'front'"), HasSubstr("front_steering_rad")));
  EXPECT_THAT(refusal_to_align(driven({0.0, 1.0}, WheelUnit::ticks), tricycle_robot()),
              HasSubstr("steering_ticks_per_revolution"));
}

TEST(Steering, online_is_that_of_the_whole_recording_and_survives_being_stored) {
  std::vector<double> angles;
  for (int i = 0; i < 300; ++i) angles.push_back(i % 17 == 3 ? kNotMeasured : std::sin(0.2 * i));
  const Recording recording = driven(angles);
  const Robot robot = tricycle_robot({.time_offset_s = -0.23});
  const std::vector<double> whole = angles_of(align(recording, robot));
  Aligner aligner(robot);
  aligner.set_units({}, {WheelUnit::radians});
  std::vector<double> online;
  const auto take = [&] {
    while (const auto interval = aligner.next()) online.push_back(interval->increment.steering_rad[0]);
  };
  for (std::size_t i = 0; i < angles.size(); ++i) {
    aligner.add(WheelReadings{.time_s = recording.wheels.time_s[i],
                              .value = {recording.wheels.series[0].value[i]},
                              .steering = {angles[i]}});
    if (i % 13 == 0) {
      Aligner resumed(robot);
      resume_state(resumed, state_of(aligner));
      ASSERT_EQ(state_of(resumed), state_of(aligner));
      aligner = resumed;
    }
    take();
    EXPECT_LT(state_of(aligner).size(), 10'000U);
  }
  aligner.finish();
  take();
  EXPECT_EQ(online, whole);
}

}  // namespace
}  // namespace trundle::recording
