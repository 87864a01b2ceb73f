// A log as it is: what `info` says of it without any mapping, and the drafts that `init` makes of it.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"
#include "logs/packed_writers.hpp"
#include "real_data.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

void put_file(const std::filesystem::path& path, std::string_view content) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << content;
}

constexpr double kStep_s = 0.02;
constexpr int kRows = 1500;

/// Half a minute that begins and ends at rest: travel of the left and of the right wheel [m], of a track of
/// 0.5 m.
struct Driven {
  double left_m = 0.0, right_m = 0.0, yaw_rate_rad_s = 0.0;
};
template <class Take>
void drive_along(Take take) {
  double left_m = 0.0, right_m = 0.0;
  for (int row = 0; row < kRows; ++row) {
    const double t = kStep_s * row;
    const bool drives = t > 3.0 && t < 27.0;
    const double speed_m_s = drives ? 0.5 : 0.0, rate_rad_s = drives ? 0.8 * std::sin(0.5 * t) : 0.0;
    left_m += kStep_s * (speed_m_s - 0.25 * rate_rad_s);
    right_m += kStep_s * (speed_m_s + 0.25 * rate_rad_s);
    take(row, Driven{left_m, right_m, rate_rad_s});
  }
}

std::string wpilog() {
  WpilogWriter log;
  const std::uint32_t left = log.start("NT:/Drive/LeftDistanceMeters", "double");
  const std::uint32_t right = log.start("NT:/Drive/RightDistanceMeters", "double");
  const std::uint32_t gyro = log.start("NT:/Drive/Gyro/YawRateDegPerSec", "double");
  const std::uint32_t volts = log.start("NT:/Drive/LeftVoltage", "double");
  double before_m = -1.0;
  drive_along([&](int row, const Driven& driven) {
    log.time_us = 1'000'000 + 20'000 * static_cast<std::uint64_t>(row);
    if (driven.left_m != before_m) log.record(left, bytes_of_number(driven.left_m));  // on change alone
    if (driven.left_m != before_m) log.record(right, bytes_of_number(driven.right_m));
    before_m = driven.left_m;
    log.record(gyro, bytes_of_number(driven.yaw_rate_rad_s * 180.0 / 3.14159265358979));
    log.record(volts, bytes_of_number(12.0 + 0.001 * row));
  });
  return log.bytes();
}

std::string dataflash() {
  DataFlashWriter log;
  log.format(128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
  log.format(129, 3 + 8 + 16 + 4, "PARM", "QNf", "TimeUS,Name,Value");
  log.format(130, 3 + 8 + 4 + 1 + 4 + 1, "WENC", "QfBfB", "TimeUS,Dist0,Qual0,Dist1,Qual1");
  log.format(131, 3 + 8 + 4 + 4 + 4, "IMU", "Qfff", "TimeUS,GyrX,GyrY,GyrZ");
  const auto parameter = [&](const char* name, float value) {
    log.message(129, bytes_of_number(std::uint64_t{1}) + padded(name, 16) + bytes_of_number(value));
  };
  parameter("WENC_RADIUS", 0.1F);
  parameter("WENC_CPR", 3200.0F);
  parameter("WENC_POS_Y", -0.25F);
  parameter("WENC2_RADIUS", 0.1F);
  parameter("WENC2_POS_Y", 0.25F);
  drive_along([&](int row, const Driven& driven) {
    const std::string time = bytes_of_number(1'000'000 + 20'000 * static_cast<std::uint64_t>(row));
    log.message(130, time + bytes_of_number(static_cast<float>(driven.left_m)) + "d" +
                         bytes_of_number(static_cast<float>(driven.right_m)) + "d");
    log.message(131, time + bytes_of_number(0.0F) + bytes_of_number(0.0F) +
                         bytes_of_number(static_cast<float>(-driven.yaw_rate_rad_s)));  // z down
  });
  return log.bytes();
}

std::string table() {
  std::string text = "stamp_ms,left_wheel_m,right_wheel_m,gyro_z_rad_s,left_pwm\n";
  drive_along([&](int row, const Driven& driven) {
    text += fmt::format("{},{},{},{},{}\n", 20 * row, driven.left_m, driven.right_m, driven.yaw_rate_rad_s,
                        row % 7);
  });
  return text;
}

constexpr std::string_view kUrdf = R"(<?xml version="1.0"?>
<!-- <joint name="left_wheel_joint" type="continuous"/> -->
<robot name="two_wheels">
  <link name="base_link"/>
  <joint name="mast" type="fixed"><parent link="base_link"/><child link="deck"/>
    <origin xyz="0.1 0 0.2" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="left_wheel_joint" type="continuous"><parent link="deck"/><child link="left_wheel"/>
    <origin xyz="0.25 0 0" rpy="-1.57 0 0"/></joint>
  <joint name="right_wheel_joint" type="continuous"><parent link="deck"/><child link="right_wheel"/>
    <origin xyz="-0.25 0 0"/></joint>
  <link name="left_wheel"><visual><geometry><cylinder length="0.02" radius="0.1"/></geometry></visual></link>
  <link name="right_wheel"><collision><geometry><sphere radius='0.11'/></geometry></collision></link>
</robot>
)";

constexpr std::string_view kController = R"(controller_manager:
  ros__parameters:
    update_rate: 100
base:
  ros__parameters:
    type: diff_drive_controller/DiffDriveController  # of ros2_control
    left_wheel_names: ["left_wheel_joint"]
    right_wheel_names:
      - right_wheel_joint
    wheel_separation: 0.5
    wheel_separation_multiplier: 1.02
    wheel_radius: 0.1
    right_wheel_radius_multiplier: 0.99
)";

class Init : public testing::Test {
 protected:
  Outcome run(const Arguments& arguments) const { return run_program(sample_.folder(), arguments); }
  std::string text(const std::string& name) const { return read_file(sample_.folder() / name); }
  void put(const std::string& name, std::string_view content) const {
    put_file(sample_.folder() / name, content);
  }

  Sample sample_;
};

TEST_F(Init, InfoListsTheTopicsOfALogAndWhereItIsCut) {
  const std::string whole = wpilog();
  put("match.wpilog", whole.substr(0, whole.size() - 1));
  const Outcome outcome = run({"info", "match.wpilog"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("match.wpilog: WPILOG, 29.98 s from 1.000 s on its clock"));
  EXPECT_THAT(outcome.out, HasSubstr("NT:/Drive/Gyro/YawRateDegPerSec"));
  EXPECT_THAT(outcome.out, HasSubstr("50.00 Hz"));
  EXPECT_THAT(outcome.out, HasSubstr("the file ends within a record: what is before it is used"));
  const auto document = nlohmann::json::parse(run({"info", "match.wpilog", "--json"}).out);
  EXPECT_EQ(document.at("format"), "WPILOG");
  EXPECT_EQ(document.at("inputs").size(), 1U);
  ASSERT_EQ(document.at("topics").size(), 4U);
  const auto& topic = document.at("topics").at(0);
  EXPECT_EQ(topic.at("topic"), "NT:/Drive/Gyro/YawRateDegPerSec");
  EXPECT_EQ(topic.at("messages"), kRows);
  EXPECT_NEAR(topic.at("rate_hz").get<double>(), 50.0, 1e-6);
  EXPECT_EQ(document.at("cut").at("reason"), "the file ends within a record");
}

TEST_F(Init, InfoOfWhatIsNoLogSaysSo) {
  put("words.bag", "these are words");
  const Outcome outcome = run({"info", "words.bag"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
}

TEST_F(Init, ADraftOfAWpilogSaysWhatItCannotKnow) {
  put("match.wpilog", wpilog());
  const Outcome outcome = run({"init", "match.wpilog", "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("diameter_m of left, right"));
  EXPECT_THAT(outcome.out, HasSubstr("y_m (left of the middle is positive) of left, right"));
  const std::string recording = text("draft/recording.toml");
  EXPECT_THAT(recording, HasSubstr("file = \"../match.wpilog\""));
  EXPECT_THAT(recording,
              HasSubstr("columns.left_m = { topic = \"NT:/Drive/LeftDistanceMeters\", field = \"value\" }"));
  // Rows come with what is written in every cycle, not with wheels that rest.
  EXPECT_THAT(recording, HasSubstr("topic = \"NT:/Drive/Gyro/YawRateDegPerSec\"\ncolumns.left_m"));
  EXPECT_THAT(recording, HasSubstr("columns.yaw_rate_rad_s = { field = \"value\", unit = \"deg/s\" }"));
  // What is left out is asked for where it stands, and nothing is invented.
  EXPECT_THAT(text("draft/robot.toml"), Not(HasSubstr("\ndiameter_m")));
}

/// As WPILib and AdvantageKit write modules: structures of an array, beside what was wanted of them.
TEST_F(Init, ModulesOfASwerveAreSteeredWheels) {
  WpilogWriter log;
  log.record(log.start("/.schema/struct:Rotation2d", "structschema"), "double value");
  log.record(log.start("/.schema/struct:SwerveModulePosition", "structschema"),
             "double distance;Rotation2d angle");
  const std::uint32_t measured = log.start("/RealOutputs/ModulePositions", "struct:SwerveModulePosition[]");
  const std::uint32_t wanted = log.start("/RealOutputs/ModuleSetpoints", "struct:SwerveModulePosition[]");
  for (int row = 0; row < 100; ++row) {
    log.time_us += 20'000;
    std::string modules;
    for (int module = 0; module < 4; ++module)
      modules += bytes_of_number(0.01 * row) + bytes_of_number(0.1 * module);
    log.record(measured, modules);
    log.record(wanted, modules);
  }
  put("swerve.wpilog", log.bytes());
  const Outcome outcome = run({"init", "swerve.wpilog", "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string recording = text("draft/recording.toml");
  EXPECT_THAT(recording, HasSubstr("topic = \"/RealOutputs/ModulePositions\"\n"));
  EXPECT_THAT(recording, HasSubstr("columns.wheel_3_m = \"value[3].distance\"\n"
                                   "columns.wheel_3_steering_rad = \"value[3].angle.value\"\n"));
  EXPECT_THAT(recording, Not(HasSubstr("Setpoints")));
  EXPECT_THAT(text("draft/robot.toml"), HasSubstr("steered = true"));
}

/// A gyro whose angle alone is logged: its differences are the rates.
TEST_F(Init, AnglesOfAGyroAreTakenWhereNoRateIsRecorded) {
  WpilogWriter log;
  const std::uint32_t left = log.start("/Drive/LeftPositionMeters", "double");
  const std::uint32_t right = log.start("/Drive/RightPositionMeters", "double");
  const std::uint32_t yaw = log.start("/Drive/Gyro/YawDegrees", "double");
  for (int row = 0; row < 500; ++row) {
    log.time_us += 20'000;
    const double turned_rad = std::sin(0.02 * row);
    log.record(left, bytes_of_number(0.01 * row - 0.25 * turned_rad));
    log.record(right, bytes_of_number(0.01 * row + 0.25 * turned_rad));
    log.record(yaw, bytes_of_number(turned_rad * 180.0 / std::numbers::pi));
  }
  put("match.wpilog", log.bytes());
  const Outcome drafted = run({"init", "match.wpilog", "-o", "draft"});
  ASSERT_EQ(drafted.exit_code, 0) << drafted.err;
  EXPECT_THAT(drafted.out, HasSubstr("gyro: yaw_rad from /Drive/Gyro/YawDegrees"));
  EXPECT_THAT(text("draft/recording.toml"),
              HasSubstr("columns.yaw_rad = { field = \"value\", unit = \"deg\" }"));
  put("robot.toml",
      "[[wheel]]\nname = \"left\"\ny_m = 0.25\ndiameter_m = 0.15\n[[wheel]]\nname = \"right\"\n"
      "y_m = -0.25\ndiameter_m = 0.15\n[gyro]\n");
  const Outcome odometry = run({"odometry", "draft", "--robot", "robot.toml", "--json"});
  ASSERT_EQ(odometry.exit_code, 0) << odometry.err;
  // Wheels and gyro agree to the last digits: both were computed of one turn.
  EXPECT_NEAR(nlohmann::json::parse(odometry.out).at("end").at("heading_rad").get<double>(),
              std::sin(0.02 * 499), 1e-3);
}

TEST_F(Init, ADraftOfArduPilotNeedsNoEdit) {
  put("rover.bin", dataflash());
  const Outcome outcome = run({"init", "rover.bin", "-o", "draft", "--json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(nlohmann::json::parse(outcome.out).at("to_fill_in").empty()) << outcome.out;
  const std::string robot = text("draft/robot.toml");
  EXPECT_THAT(robot, HasSubstr("name = \"left\"\ny_m = 0.25\ndiameter_m = 0.2\nrecorded_diameter_m = 0.2\n"));
  EXPECT_THAT(robot, HasSubstr("name = \"right\"\ny_m = -0.25\n"));
  EXPECT_THAT(text("draft/recording.toml"),
              HasSubstr("columns.yaw_rate_rad_s = { field = \"GyrZ\", sign = -1 }"));
  const Outcome calibrated =
      run({"calibrate", "draft", "--robot", "draft/robot.toml", "-o", "calibrated.toml", "--json"});
  EXPECT_EQ(calibrated.exit_code, 0) << calibrated.err;
  const Outcome slips = run({"slip", "draft", "--robot", "draft/robot.toml", "-o", "slip.csv", "--json"});
  EXPECT_EQ(slips.exit_code, 0) << slips.err;
  EXPECT_EQ(std::ranges::count(text("slip.csv"), '\n') - std::ranges::count(text("slip.csv"), '#'), 1)
      << text("slip.csv");
}

TEST_F(Init, TablesAndAUrdfMakeARecordingThatRuns) {
  put("drive/log.csv", table());
  put("robot.urdf", kUrdf);
  const Outcome outcome = run({"init", "drive", "--urdf", "robot.urdf", "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, Not(HasSubstr("to fill in"))) << outcome.out;
  EXPECT_THAT(text("draft/recording.toml"), HasSubstr("time_unit = \"ms\""));
  const std::string robot = text("draft/robot.toml");
  EXPECT_THAT(robot, HasSubstr("name = \"two_wheels\""));
  EXPECT_THAT(robot, HasSubstr("name = \"left\"\nx_m = 0.1\ny_m = 0.25\ndiameter_m = 0.2\n"));
  EXPECT_THAT(robot, HasSubstr("diameter_m = 0.22\n"));
  const Outcome odometry =
      run({"odometry", "draft", "--robot", "draft/robot.toml", "-o", "trajectory.csv", "--json"});
  EXPECT_EQ(odometry.exit_code, 0) << odometry.err;
}

// As loggers of small robots export them: names of two words, a semicolon, a column of text, degrees.
TEST_F(Init, ColumnsOfASimpleLoggerAreKnown) {
  std::string wheels = "time;left_rpm;right_rpm;status\n", imu = "time,gyro_x,gyro_y,gyro_z\n",
              fixes = "time;lat;lon\n";
  drive_along([&](int row, const Driven& driven) {
    wheels += fmt::format("{};{};{};OK\n", kStep_s * row, driven.left_m, driven.right_m);
    imu +=
        fmt::format("{},{},{},{}\n", kStep_s * row, 0.1 * row, -0.2 * row, driven.yaw_rate_rad_s * 57.2958);
    fixes += fmt::format("{};48.{:06};11.575\n", kStep_s * row, row);
  });
  put("logger/wheels.csv", wheels);
  put("logger/imu.csv", imu);
  put("logger/gps.csv", fixes);
  ASSERT_EQ(run({"init", "logger", "-o", "mine"}).exit_code, 0);
  const std::string draft = text("mine/recording.toml");
  EXPECT_THAT(draft, HasSubstr("delimiter = \";\""));
  EXPECT_THAT(draft, HasSubstr("columns.left_rad_s = { column = \"left_rpm\", unit = \"rpm\" }"));
  EXPECT_THAT(draft, HasSubstr("columns.yaw_rate_rad_s = { column = \"gyro_z\", unit = \"deg/s\" }"));
  EXPECT_THAT(draft, Not(HasSubstr("gyro_x")));
  EXPECT_THAT(draft, HasSubstr("columns.latitude_deg = \"lat\""));
}

TEST_F(Init, WhereNothingIsRecognisedNoRunIsAdvised) {
  put("empty/data.csv", "a,b\n1,2\n3,4\n");
  const Outcome drafted = run({"init", "empty", "-o", "mine"});
  EXPECT_EQ(drafted.exit_code, 0);
  EXPECT_THAT(drafted.out, Not(HasSubstr("trundle run")));
}

TEST_F(Init, AControllerSaysTrackAndRadii) {
  put("drive/log.csv", table());
  put("controller.yaml", kController);
  const Outcome outcome = run({"init", "drive", "--controller", "controller.yaml", "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const std::string robot = text("draft/robot.toml");
  EXPECT_THAT(robot, HasSubstr("name = \"left\"\nx_m = 0\ny_m = 0.255\ndiameter_m = 0.2\n"));
  EXPECT_THAT(robot, HasSubstr("name = \"right\"\nx_m = 0\ny_m = -0.255\ndiameter_m = 0.198\n"));
}

/// Its joints turn and its /odom says how far: the controller's own numbers come out, and that it took left
/// for right.
TEST_F(Init, WhatTheControllerTookForItsWheelsIsFoundInItsOdometry) {
  TRUNDLE_NEEDS_REAL_DATA("logs/gsid_square.bag");
  const std::string bag = real_data() / "logs" / "gsid_square.bag";
  const Outcome outcome = run({"init", bag, "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, Not(HasSubstr("to fill in")));
  EXPECT_THAT(outcome.out, HasSubstr("/odom turns the other way than its wheels say by their names"));
  EXPECT_THAT(text("draft/robot.toml"), HasSubstr("diameter_m = 0.07000"));  // as Gazebo has it
}

TEST_F(Init, WhatAPersonWroteIsNotLost) {
  put("drive/log.csv", table());
  ASSERT_EQ(run({"init", "drive", "-o", "draft"}).exit_code, 0);
  ASSERT_EQ(run({"init", "drive", "-o", "draft"}).exit_code, 0);  // the same again
  put("draft/robot.toml", "name = \"mine\"\n");
  const Outcome outcome = run({"init", "drive", "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_EQ(text("draft/robot.toml"), "name = \"mine\"\n");
}

TEST_F(Init, GeometryThatIsNoneIsNamedInOneLine) {
  put("drive/log.csv", table());
  put("xacro.urdf", "<robot name='r'><xacro:include filename='x'/></robot>");
  put("open.urdf", "<robot name=\"r\">\n<link name=\"a");
  put("none.urdf", "words");
  put("still.urdf", "<robot><joint name='a' type='fixed'/></robot>");
  put("numbers.urdf", "<robot><joint name='a' type='continuous'><origin xyz='0 x 0'/></joint></robot>");
  put("none.yaml", "update_rate: 50\n");
  put("zero.yaml", "wheel_radius: 0\n");
  for (const auto& [option, file, says] : std::vector<std::array<std::string, 3>>{
           {"--urdf", "xacro.urdf", "xacro FILE > robot.urdf"},
           {"--urdf", "open.urdf", "open.urdf:2: an element is not closed"},
           {"--urdf", "none.urdf", "'robot'"},
           {"--urdf", "still.urdf", "continuous"},
           {"--urdf", "numbers.urdf", "'0 x 0' are not three numbers"},
           {"--controller", "none.yaml", "wheel_separation"},
           {"--controller", "zero.yaml", "wheel_radius is '0'"}}) {
    const Outcome outcome = run({"init", "drive", option, file, "-o", "draft"});
    EXPECT_EQ(outcome.exit_code, 3) << file;
    EXPECT_THAT(outcome.err, IsOneLineOfError());
    EXPECT_THAT(outcome.err, HasSubstr(says));
  }
}

}  // namespace
}  // namespace trundle::test
