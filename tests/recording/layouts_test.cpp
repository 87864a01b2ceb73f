#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/recording.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;

void write_mrclam(const test::Folder& folder) {
  folder.write("Barcodes.dat", "# Subject #    Barcode #\n  1 \t   5\n  2 \t  14\n  6 \t  72\n  7 \t  27\n");
  folder.write("Landmark_Groundtruth.dat",
               "# Subject x y\n  6 \t 0.5 \t -4.25 \t 0.1 \t 0.1\n  7 \t 1 \t 2 \t 0.1 \t 0.1\n");
  folder.write("Robot3_Odometry.dat",
               "# Time v w\n1248444187.156 \t  0.1 \t -0.4\n1248444187.186 \t  0.2 \t 0.5\n1248444187.256 \t "
               " 0.3 \t 0.6\n");
  folder.write(
      "Robot3_Measurement.dat",
      "# Time Subject range bearing\n1248444187.2 \t 72 \t 1.5 \t 0.1\n1248444187.2 \t 5 \t 1 \t 0\n"
      "1248444187.2 \t 14 \t 1 \t 0\n1248444187.2 \t 99 \t 1 \t 0\n1248444187.3 \t 27 \t 2.5 \t -0.1\n");
  folder.write("Robot3_Groundtruth.dat",
               "# Time x y h\n1248444187.1 \t 1 \t 2 \t 3.1\n1248444187.2 \t 1 \t 2 \t -3.1\n");
}

TEST(Mrclam, is_recognised_and_its_barcodes_become_subjects) {
  const test::Folder folder;
  write_mrclam(folder);
  const Recording recording = read_recording(folder.path());
  EXPECT_EQ(recording.name, "run_Robot3");
  ASSERT_THAT(recording.sightings, SizeIs(2));
  EXPECT_EQ(recording.sightings[0].landmark, "6");
  EXPECT_EQ(recording.sightings[1].landmark, "7");
  EXPECT_EQ(recording.sightings[1].range_m, 2.5);
  ASSERT_THAT(recording.landmarks, SizeIs(2));
  EXPECT_EQ(recording.landmarks[0].name, "6");
  EXPECT_EQ(recording.landmarks[0].position, Vector2(0.5, -4.25));
  EXPECT_NEAR(recording.reference.heading_rad[1], 2.0 * kPi - 3.1, 1e-12);
  EXPECT_THAT(recording.inputs, SizeIs(5));
  const auto count = [&](FindingCode code) {
    for (const Finding& problem : recording.findings)
      if (problem.code == code) return problem.count;
    return std::size_t{0};
  };
  EXPECT_EQ(count(FindingCode::sighting_of_a_robot), 2U);
  EXPECT_EQ(recording.seen_as, "3");
  ASSERT_THAT(recording.robot_sightings, SizeIs(2));
  EXPECT_EQ(recording.robot_sightings[0].landmark, "1");
  EXPECT_EQ(recording.robot_sightings[1].landmark, "2");
  EXPECT_THAT(mrclam_robots(folder.path()), ElementsAre(3));
  EXPECT_EQ(count(FindingCode::unknown_barcode), 1U);
}

TEST(Robots, are_kept_apart_from_landmarks) {
  const test::Folder folder;
  folder.write("velocity.csv", "time_s,forward_m_s,yaw_rate_rad_s\n0,1,0\n1,1,0\n");
  folder.write("sightings.csv", "time_s,landmark,range_m,bearing_rad\n0.1,tree,1,0\n0.2,b,2,0\n0.3,,3,0\n");
  folder.write("recording.toml", "seen_as = \"a\"\nrobots = [\"b\", \"c\"]\n");
  const Recording recording = read_recording(folder.path());
  EXPECT_EQ(recording.seen_as, "a");
  ASSERT_THAT(recording.sightings, SizeIs(2));
  EXPECT_EQ(recording.sightings[0].landmark, "tree");
  ASSERT_THAT(recording.robot_sightings, SizeIs(1));
  EXPECT_EQ(recording.robot_sightings[0].landmark, "b");
  EXPECT_EQ(recording.robot_sightings[0].range_m, 2.0);
}

TEST(Robots, are_a_list_of_names) {
  const test::Folder folder;
  folder.write("velocity.csv", "time_s,forward_m_s,yaw_rate_rad_s\n0,1,0\n1,1,0\n");
  for (const char* list : {"robots = \"b\"\n", "robots = [1]\n", "robots = [\"b\", 2]\n"}) {
    folder.write("recording.toml", list);
    try {
      (void)read_recording(folder.path());
      ADD_FAILURE() << list;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("robots is no list of texts"));
    }
  }
}

TEST(Mrclam, holds_a_velocity_until_the_next_row) {
  const test::Folder folder;
  write_mrclam(folder);
  const AlignedReadings readings = align(read_recording(folder.path()), Robot{});
  ASSERT_THAT(readings.increments, SizeIs(2));
  EXPECT_NEAR(readings.increments[0].turned[0], 0.1 * 0.03, 1e-7);
  EXPECT_NEAR(readings.increments[0].turned[1], -0.4 * 0.03, 1e-7);
  EXPECT_NEAR(readings.increments[1].turned[0], 0.2 * 0.07, 1e-7);
}

TEST(Mrclam, asks_which_robot) {
  const test::Folder folder;
  write_mrclam(folder);
  folder.write("Robot1_Odometry.dat", "1 2 3\n2 3 4\n");
  const auto message = [&](int number) {
    try {
      read_recording(folder.path(), {.robot_number = number});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(message(0), HasSubstr("holds the robots 1, 3; expected --robot-number with one of 1, 3"));
  EXPECT_THAT(message(2), HasSubstr("holds no robot 2; expected --robot-number with one of 1, 3"));
  EXPECT_EQ(read_recording(folder.path(), {.robot_number = 3}).name, "run_Robot3");
  EXPECT_THAT(recordings_below(folder.path()), ElementsAre(folder.path()));
}

constexpr const char* kTuples =
    "{\"T\": 0.5, \"phi_l\": 2, \"phi_r\": 4, \"sm\": [0.1, 0.2, 0.3]} {\"T\": 1.5, \"phi_l\": 1, \"phi_r\": "
    "1, \"sm\": [1, 2, 3]}\n"
    "\n{\"T\": 1, \"phi_l\": 0, \"phi_r\": -1, \"sm\": [-1e-3, 0, 0]}\n";

void expect_the_tuples(const Recording& recording) {
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0, 0.5, 2, 3));
  EXPECT_EQ(recording.wheels.series[0].wheel, "left");
  EXPECT_EQ(recording.wheels.series[1].unit, WheelUnit::rate);
  EXPECT_EQ(recording.wheels.series[1].value[1], 4.0);
  EXPECT_EQ(recording.wheels.series[1].value[3], -1.0);
  ASSERT_THAT(recording.relative_motions, SizeIs(3));
  EXPECT_EQ(recording.relative_motions[1].start_s, 0.5);
  EXPECT_EQ(recording.relative_motions[1].end_s, 2.0);
  EXPECT_EQ(recording.relative_motions[1].motion.heading, 3.0);
  EXPECT_TRUE(recording.has_reference());
}

TEST(Tuples, are_a_recording_of_their_own) {
  const test::Folder folder;
  const Recording recording = read_recording(folder.write("lmov.tuple", kTuples));
  EXPECT_EQ(recording.name, "lmov");
  EXPECT_EQ(recording.session, "run");
  expect_the_tuples(recording);
}

TEST(Tuples, are_named_by_recording_toml) {
  const test::Folder folder;
  folder.write("lmov.tuple", kTuples);
  folder.write("recording.toml", "session = \"s\"\ntuple_file = \"lmov.tuple\"\n");
  const Recording recording = read_recording(folder.path());
  EXPECT_EQ(recording.session, "s");
  expect_the_tuples(recording);
  folder.write("recording.toml", "[relative_motion]\ntuple_file = \"lmov.tuple\"\n");
  expect_the_tuples(read_recording(folder.path()));
}

TEST(Tuples, align_to_the_turns_of_their_rates) {
  const test::Folder folder;
  Robot robot;
  robot.chassis = differential_drive({0.1, 0.0, 0}, 0.1);
  robot.wheel_names = {"left", "right"};
  const AlignedReadings readings = align(read_recording(folder.write("lmov.tuple", kTuples)), robot);
  ASSERT_THAT(readings.increments, SizeIs(3));
  EXPECT_NEAR(readings.increments[0].turned[1], 4.0 * 0.5 / (2.0 * kPi), 1e-15);
  EXPECT_NEAR(readings.increments[2].turned[1], -1.0 / (2.0 * kPi), 1e-15);
}

}  // namespace
}  // namespace trundle::recording
