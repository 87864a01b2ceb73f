// Real recordings, each with the traps that its description warns of; skipped where they are missing.
#include "real_data.hpp"

#include <cmath>
#include <fstream>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/inspection/inspect.hpp"
#include "trundle/recording/alignment/align.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/recording/time_offset.hpp"
#include "trundle/recording/trajectory_file.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
using namespace inspection;
namespace {

using testing::IsEmpty;
using testing::SizeIs;

std::string file(const char* path) {
  return (test::real_data() / path).string();
}

double travel_of(const AlignedReadings& readings, std::size_t wheel) {
  double total = 0.0;
  for (const Increment& increment : readings.increments) total += increment.turned[wheel];
  return total;
}

Robot robot_with(const std::vector<std::string>& names, const WheelSize& size, double track_m) {
  Robot robot;
  robot.wheel_names = names;
  robot.chassis = names.size() == 2 ? differential_drive(size, track_m) : skid_steer(size, track_m, 0.5);
  return robot;
}

TEST(RealData, increments_of_a_differential_drive_without_header) {
  TRUNDLE_NEEDS_REAL_DATA("optiodom_diff");
  const test::Folder folder;
  const std::string run = file("optiodom_diff/square/230620202042/230620202042_run-01.csv");
  folder.write("recording.toml", fmt::format(R"(
session = "230620202042"
[wheels]
file = "{0}"
header = false
increments = true
columns = {{ time_s = 1, right_ticks = 5, left_ticks = 6 }}
[reference]
file = "{0}"
header = false
columns = {{ time_s = 1, x_m = 2, y_m = 3, heading_rad = 4 }}
)",
                                             run));
  const Recording recording = read_recording(folder.path());
  EXPECT_THAT(recording.findings, IsEmpty());
  EXPECT_THAT(recording.wheels.time_s, SizeIs(1814));
  const Trajectory reference = reference_trajectory(recording);
  // Four legs of 0.75 m and a full turn clockwise, and the wheels say the same to 2 %.
  const double turn = reference.poses.back().pose.heading - reference.poses.front().pose.heading;
  EXPECT_NEAR(std::abs(turn), 2.0 * kPi, 0.1);
  const AlignedReadings readings = align(recording, robot_with({"left", "right"}, {0.084, 2796.8, 0}, 0.2));
  const double left_m = kPi * 0.084 * travel_of(readings, 0);
  const double right_m = kPi * 0.084 * travel_of(readings, 1);
  EXPECT_NEAR((right_m - left_m) / 0.2, turn, 0.02 * 2.0 * kPi);
}

TEST(RealData, nanosecond_stamps_and_a_counter_of_sixteen_bits) {
  TRUNDLE_NEEDS_REAL_DATA("kobuki_slip");
  const test::Folder folder;
  folder.write("recording.toml",
               fmt::format(R"(
time_origin = "first"
[wheels]
file = "{}"
time_unit = "ns"
columns = {{ time_s = "stamp_ns", left_ticks = "left_ticks", right_ticks = "right_ticks" }}
[gyro]
file = "{}"
time_unit = "ns"
columns = {{ time_s = "stamp_ns", yaw_rate_rad_s = "gz_rads" }}
)",
                           file("kobuki_slip/nonfaulty/core.csv"), file("kobuki_slip/nonfaulty/imu.csv")));
  const Recording recording = read_recording(folder.path());
  EXPECT_EQ(recording.wheels.time_s.front(), 0.828639784);
  Robot robot = robot_with({"left", "right"}, {0.0704, 2578.33, 16}, 0.230);
  robot.chassis.gyro = Gyro{};
  const AlignedReadings readings = align(recording, robot);
  double gyro = 0.0, left = 0.0, right = 0.0;
  for (const Increment& increment : readings.increments) {
    EXPECT_LT(std::abs(increment.turned[0]), 0.2);  // a wrap not undone is 25 revolutions
    if (!increment.has_gyro) continue;
    gyro += increment.gyro_rad;
    left += increment.turned[0];
    right += increment.turned[1];
  }
  // Without tape the wheels and the gyro agree to about 10 degrees.
  EXPECT_NEAR(kPi * 0.0704 * (right - left) / 0.230, gyro, radians(15.0));
  const std::vector<Finding> problems = inspect(recording, robot, overview_of(recording, robot));
  EXPECT_TRUE(std::any_of(problems.begin(), problems.end(),
                          [](const Finding& p) { return p.code == FindingCode::wrap && p.count == 2; }));
  EXPECT_TRUE(std::none_of(problems.begin(), problems.end(), [](const Finding& p) {
    return p.code == FindingCode::counter_reset || p.code == FindingCode::stuck_encoder;
  }));
}

TEST(RealData, mrclam_as_it_is) {
  TRUNDLE_NEEDS_REAL_DATA("mrclam/MRCLAM_Dataset6");
  const std::filesystem::path folder = test::real_data() / "mrclam/MRCLAM_Dataset6";
  const Recording recording = read_recording(folder, {.robot_number = 1});
  EXPECT_THAT(recording.landmarks, SizeIs(15));
  EXPECT_THAT(recording.sightings, SizeIs(1534));
  for (const Sighting& sighting : recording.sightings) {
    const int subject = std::stoi(sighting.landmark);
    EXPECT_TRUE(subject >= 6 && subject <= 20) << subject;
  }
  const AlignedReadings readings = align(recording, Robot{});
  EXPECT_THAT(readings.increments, SizeIs(recording.velocity.time_s.size() - 1));
  EXPECT_NEAR(travel_of(readings, 0), 48.4, 0.1);
}

TEST(RealData, censi_tuples) {
  TRUNDLE_NEEDS_REAL_DATA("censi_calibration");
  const Recording recording = read_recording(test::real_data() / "censi_calibration/lmov.tuple");
  EXPECT_THAT(recording.relative_motions, SizeIs(4345));
  EXPECT_NEAR(recording.wheels.time_s.back(), 3474.0, 1.0);
  EXPECT_THAT(align(recording, robot_with({"left", "right"}, {0.041, 0.0, 0}, 0.088)).increments,
              SizeIs(4345));
}

TEST(RealData, four_encoders_of_a_skid_steer_and_an_imu) {
  TRUNDLE_NEEDS_REAL_DATA("ese650_skidsteer");
  const test::Folder folder;
  folder.write("recording.toml", fmt::format(R"(
[wheels]
file = "{0}/encoders20.csv"
increments = true
columns = {{ time_s = "t_unix_s", front_right_ticks = "FR", front_left_ticks = "FL", rear_right_ticks = "RR", rear_left_ticks = "RL" }}
[gyro]
file = "{0}/imu20.csv"
columns = {{ time_s = "t_unix_s", yaw_rate_rad_s = "yaw_gyro_rads" }}
[accel]
file = "{0}/imu20.csv"
[accel.columns]
time_s = "t_unix_s"
x_m_s2 = {{ column = "ax_g", unit = "g" }}
y_m_s2 = {{ column = "ay_g", unit = "g" }}
)",
                                             file("ese650_skidsteer")));
  const Recording recording = read_recording(folder.path());
  Robot robot = robot_with({"front_left", "front_right", "rear_left", "rear_right"}, {0.254, 360.0, 0}, 0.92);
  robot.chassis.gyro = Gyro{};
  const AlignedReadings readings = align(recording, robot);
  double gyro = 0.0, difference = 0.0, gyro_way = 0.0;
  for (const Increment& i : readings.increments) {
    if (!i.has_gyro) continue;
    gyro += i.gyro_rad;
    gyro_way += std::abs(i.gyro_rad);
    difference += kPi * 0.254 * (i.turned[1] + i.turned[3] - i.turned[0] - i.turned[2]) / 2.0;
  }
  EXPECT_GT(gyro_way, 10.0);
  EXPECT_NEAR(difference / 0.92, gyro, 0.1 * gyro_way);
  const std::vector<std::string> missing = missing_in(recording, &robot);
  ASSERT_THAT(missing, SizeIs(1));
  EXPECT_THAT(missing[0], testing::HasSubstr("the effective track in proportion to the wheel diameters"));
}

/// The windows of 2 s of one surface, one after the other.
Recording warthog(const std::filesystem::path& path) {
  Recording recording;
  recording.wheels.series = {{"left", WheelUnit::rate, {}}, {"right", WheelUnit::rate, {}}};
  std::ifstream stream(path);
  std::string line;
  std::getline(stream, line);
  while (std::getline(stream, line)) {
    std::istringstream cells(line);
    std::vector<double> cell;
    for (std::string text; std::getline(cells, text, ',');) cell.push_back(std::stod(text));
    // window, calib_step, steady, transitory, k, t_s, cmd left, right, wheel left, right, yaw rate, ...
    const double time_s = 2.0 * cell[0] + cell[5];
    recording.wheels.time_s.push_back(time_s);
    recording.wheels.series[0].value.push_back(cell[8]);
    recording.wheels.series[1].value.push_back(cell[9]);
    recording.gyro.time_s.push_back(time_s);
    recording.gyro.yaw_rate_rad_s.push_back(cell[10]);
  }
  return recording;
}

TEST(RealData, gyros_that_were_mounted_the_other_way) {
  TRUNDLE_NEEDS_REAL_DATA("warthog_drive");
  Robot robot = robot_with({"left", "right"}, {0.6, 0.0, 0}, 1.08);
  for (Wheel& wheel : robot.chassis.wheels()) wheel.kind = WheelKind::skid;
  robot.chassis.gyro = Gyro{};
  for (const auto& [name, inverted] : {std::pair{"warthog_wheels_asphalt.csv", false},
                                       {"warthog_wheels_gravel_2024_8_6_11h37s32.csv", true},
                                       {"warthog_wheels_ice_2024_7_30_16h30s21.csv", true}}) {
    const Recording recording = warthog(test::real_data() / "warthog_drive" / name);
    ASSERT_GT(recording.gyro.time_s.size(), 10000U);
    const std::vector<Finding> problems = inspect(recording, robot, overview_of(recording, robot));
    EXPECT_EQ(std::any_of(problems.begin(), problems.end(),
                          [](const Finding& p) { return p.code == FindingCode::gyro_sign; }),
              inverted)
        << name;
  }
}

/// Known to be 40 to 80 ms; the wheels of two of the three robots slip.
TEST(RealData, time_offset_of_a_gyro_whose_clock_is_late) {
  TRUNDLE_NEEDS_REAL_DATA("kobuki_slip");
  Robot robot = robot_with({"left", "right"}, {0.0704, 2578.33, 16}, 0.230);
  robot.chassis.gyro = Gyro{};
  for (const char* run : {"nonfaulty", "left_faulty", "right_faulty"}) {
    const test::Folder folder;
    folder.write("recording.toml", fmt::format(R"(
[wheels]
file = "{0}/core.csv"
columns = {{ time_s = "stamp_ns", left_ticks = "left_ticks", right_ticks = "right_ticks" }}
time_unit = "ns"
[gyro]
file = "{0}/imu.csv"
columns = {{ time_s = "stamp_ns", yaw_rate_rad_s = "gz_rads" }}
time_unit = "ns"
)",
                                               file("kobuki_slip") + "/" + run));
    const auto found = gyro_time_offset(read_recording(folder.path()), robot);
    ASSERT_TRUE(found) << run;
    EXPECT_GT(found->offset_s, -0.080) << run;
    EXPECT_LT(found->offset_s, -0.040) << run;
    EXPECT_LT(found->sigma_s, 0.003) << run;
    EXPECT_GT(found->correlation, 0.9) << run;
    RecordProperty(std::string(run) + "_ms",
                   fmt::format("{:.1f} ± {:.1f}", 1e3 * found->offset_s, 1e3 * found->sigma_s));
  }
}

}  // namespace
}  // namespace trundle::recording
