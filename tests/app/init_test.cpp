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
#include "trundle/statistics/random.hpp"

#include "app/driven_logs.hpp"
#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"
#include "logs/packed_writers.hpp"
#include "logs/ros_writers.hpp"
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

/// A bag of a robot with an Imu that hangs upside down and a camera that looks to the left, by its static
/// transforms.
std::string bag_with_frames() {
  const std::string header = "\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
  const std::string vector = "===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n",
                    quaternion =
                        "===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n",
                    transform =
                        "===\nMSG: geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n";
  WrittenLog log{
      .channels =
          {{"/joint_states", "sensor_msgs/JointState",
            "Header header\nstring[] name\nfloat64[] position\n" + header},
           {"/imu", "sensor_msgs/Imu",
            "Header header\ngeometry_msgs/Vector3 angular_velocity\n" + header + vector},
           {"/tf_static", "tf2_msgs/TFMessage",
            "geometry_msgs/TransformStamped[] transforms\n===\nMSG: geometry_msgs/TransformStamped\nHeader "
            "header\nstring child_frame_id\nTransform transform" +
                header + vector + quaternion + transform},
           {"/fiducial_transforms", "fiducial_msgs/FiducialTransformArray",
            "Header header\nFiducialTransform[] transforms\n===\nMSG: fiducial_msgs/FiducialTransform\nint32 "
            "fiducial_id\ngeometry_msgs/Transform transform" +
                header + vector + quaternion + transform}},
      .messages = {}};
  const auto stamped = [](int row, const char* frame) {
    RosBytes bytes;
    bytes.put(std::uint32_t{0}).put(std::uint32_t{1'700'000'000} + static_cast<std::uint32_t>(row / 50));
    return bytes.put(static_cast<std::uint32_t>(row % 50 * 20'000'000)).text(frame);
  };
  const auto frame = [&](const char* child, std::array<double, 3> at, std::array<double, 4> xyzw) {
    RosBytes bytes = stamped(0, "base_link");
    bytes.text(child);
    for (const double number : at) bytes.put(number);
    for (const double number : xyzw) bytes.put(number);
    return bytes.bytes();
  };
  log.messages.push_back(
      {2, 1'700'000'000'000'000'000,
       RosBytes()
           .put(std::uint32_t{2})
           .raw(frame("imu_link", {0.1, 0.0, 0.2}, {1.0, 0.0, 0.0, 0.0}))
           // Optical: z ahead, x right; that is base_link's y, x
           .raw(frame("camera_optical", {0.2, 0.1, 0.3}, {-0.7071067811865476, 0.0, 0.0, 0.7071067811865476}))
           .bytes()});
  drive_along([&](int row, const Driven& driven) {
    const std::int64_t time_ns = 1'700'000'000'000'000'000 + std::int64_t{row} * 20'000'000;
    RosBytes joints = stamped(row, "");
    joints.put(std::uint32_t{2}).text("left_wheel").text("right_wheel").put(std::uint32_t{2});
    log.messages.push_back({0, time_ns, joints.put(driven.left_m / 0.1).put(driven.right_m / 0.1).bytes()});
    log.messages.push_back(
        {1, time_ns, stamped(row, "imu_link").put(0.0).put(0.0).put(-driven.yaw_rate_rad_s).bytes()});
    RosBytes tags = stamped(row, "camera_optical");
    tags.put(std::uint32_t{1}).put(std::int32_t{7});
    for (const double number : {-0.5, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0}) tags.put(number);
    if (row % 10 == 0) log.messages.push_back({3, time_ns, tags.bytes()});
  });
  return bag_of(log);
}

/// No accelerometer says here which axis of the Imu is up, and no file where the camera is: the transforms
/// do.
TEST_F(Init, StaticTransformsSayHowSensorsAreMounted) {
  put("drive.bag", bag_with_frames());
  put("robot.urdf",
      R"(<robot name="r"><joint name="left_wheel" type="continuous"><origin xyz="0 0.25 0"/><child link="l"/></joint>
    <joint name="right_wheel" type="continuous"><origin xyz="0 -0.25 0"/><child link="r"/></joint>
    <link name="l"><visual><geometry><cylinder radius="0.1"/></geometry></visual></link>
    <link name="r"><visual><geometry><cylinder radius="0.1"/></geometry></visual></link></robot>)");
  const Outcome outcome = run({"init", "drive.bag", "--urdf", "robot.urdf", "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, Not(HasSubstr("to fill in"))) << outcome.out;
  EXPECT_THAT(text("draft/recording.toml"), HasSubstr("topic = \"/imu\"\nbody_frame = \"base_link\"\n"));
  EXPECT_THAT(text("draft/recording.toml"),
              HasSubstr("topic = \"/fiducial_transforms\"\ncolumns.landmark = \"transforms[].fiducial_id\"\n"
                        "columns.x_m = \"transforms[].transform.translation.z\"\n"
                        "columns.y_m = { field = \"transforms[].transform.translation.x\", sign = -1 }\n"));
  EXPECT_THAT(text("draft/robot.toml"),
              HasSubstr("[landmark_sensor]\nx_m = 0.2\ny_m = 0.1\nheading_deg = 90\n"));
  const Outcome calibrated =
      run({"calibrate", "draft", "--robot", "draft/robot.toml", "-o", "calibrated.toml", "--json"});
  EXPECT_EQ(calibrated.exit_code, 0) << calibrated.err;
  const Outcome info = run({"info", "draft", "--robot", "draft/robot.toml"});
  EXPECT_THAT(info.out, HasSubstr("the transform from base_link to imu_link"));
  EXPECT_THAT(info.out, Not(HasSubstr("gyro and wheels turn against each other")));
}

TEST_F(Init, WhatIsDoneNextDependsOnWhatIsThere) {
  WpilogWriter gyro;
  const std::uint32_t rate = gyro.start("/Gyro/YawRate", "double");
  for (int row = 0; row < 100; ++row) {
    gyro.time_us += 20'000;
    gyro.record(rate, bytes_of_number(0.01 * row));
  }
  put("gyro.wpilog", gyro.bytes());
  const Outcome alone = run({"init", "gyro.wpilog", "-o", "alone"});
  EXPECT_THAT(alone.out, HasSubstr("next: nothing in the log says how the robot moved"));
  put("match.wpilog", wpilog());
  EXPECT_THAT(run({"init", "match.wpilog", "-o", "match"}).out,
              HasSubstr("next: fill that in, then trundle run match"));
}

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
  EXPECT_EQ(topic.at("messages"), kDrivenRows);
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

/// Five seconds in which no wheel turns, of a gyro of 50 Hz: its noise is known to 6 %.
TEST_F(Init, TheRestsOfALogShowTheNoiseOfItsGyro) {
  constexpr double kBias = 0.012, kDensity = 4e-4;  // [rad/s], [rad/s/√Hz]
  const auto logged = [&](double resolution) {
    statistics::Random random(1, 2);
    std::string text = "stamp_ms,left_wheel_m,right_wheel_m,gyro_z_rad_s\n";
    drive_along([&](int row, const Driven& driven) {
      const double rate = driven.yaw_rate_rad_s + kBias + random.normal(kDensity / std::sqrt(kDrivenStep_s));
      text += fmt::format("{},{},{},{}\n", 20 * row, driven.left_m, driven.right_m,
                          resolution * std::round(rate / resolution));
    });
    return text;
  };
  put("drive/log.csv", logged(1e-6));
  const Outcome outcome = run({"init", "drive", "-o", "mine", "--json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const nlohmann::json gyro = nlohmann::json::parse(outcome.out).at("gyro");
  const double sigma = gyro.at("noise_sigma");
  EXPECT_NEAR(gyro.at("noise_rad_s_sqrt_hz").get<double>(), kDensity, 4.0 * sigma);
  EXPECT_LT(sigma, 0.1 * kDensity);
  EXPECT_NEAR(gyro.at("bias_rad_s").get<double>(), kBias, 4.0 * kDensity / std::sqrt(5.0));
  EXPECT_THAT(text("mine/robot.toml"), HasSubstr("[gyro]\n# From 5 s in which no wheel turns"));
  EXPECT_THAT(text("mine/robot.toml"), HasSubstr("\nnoise_rad_s_sqrt_hz = 0.0004"));
  // In steps that hide the noise, or without a rest, it stays as it is by default.
  put("coarse/log.csv", logged(0.01));
  ASSERT_EQ(run({"init", "coarse", "-o", "rough"}).exit_code, 0);
  EXPECT_THAT(text("rough/robot.toml"), Not(HasSubstr("noise_rad_s_sqrt_hz")));
}

// As loggers of small robots export them: names of two words, a semicolon, a column of text, degrees.
TEST_F(Init, ColumnsOfASimpleLoggerAreKnown) {
  std::string wheels = "time;left_rpm;right_rpm;status\n", imu = "time,gyro_x,gyro_y,gyro_z\n",
              fixes = "time;lat;lon\n";
  drive_along([&](int row, const Driven& driven) {
    wheels += fmt::format("{};{};{};OK\n", kDrivenStep_s * row, driven.left_m, driven.right_m);
    imu += fmt::format("{},{},{},{}\n", kDrivenStep_s * row, 0.1 * row, -0.2 * row,
                       driven.yaw_rate_rad_s * 57.2958);
    fixes += fmt::format("{};48.{:06};11.575\n", kDrivenStep_s * row, row);
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

/// Wheels, and what a motion capture saw of them: in millimetres, with headings.
std::string captured_table() {
  std::string text = "Time (s),X (mm),Y (mm),Yaw (deg)\n";
  drive_along([&](int row, const Driven& driven) {
    text +=
        fmt::format("{},{},{},{}\n", kDrivenStep_s * row, 1e3 * driven.left_m, row, 30.0 * driven.right_m);
  });
  return text;
}

// Odometry would follow what it is to be compared with.
TEST_F(Init, TheHeadingOfAReferenceIsNoGyro) {
  put("seen/wheels.csv", table());
  put("seen/mocap.csv", captured_table());
  ASSERT_EQ(run({"init", "seen", "-o", "mine"}).exit_code, 0);
  EXPECT_THAT(text("mine/recording.toml"), HasSubstr("columns.yaw_rate_rad_s = \"gyro_z_rad_s\""));
  std::filesystem::remove(sample_.folder() / "seen/wheels.csv");
  std::string ticks = "time_s,left_ticks,right_ticks\n";
  drive_along([&](int row, const Driven& driven) {
    ticks +=
        fmt::format("{},{:.0f},{:.0f}\n", kDrivenStep_s * row, 1e4 * driven.left_m, 1e4 * driven.right_m);
  });
  put("seen/encoders.csv", ticks);
  ASSERT_EQ(run({"init", "seen", "-o", "yours"}).exit_code, 0);
  const std::string draft = text("yours/recording.toml");
  EXPECT_THAT(draft, Not(HasSubstr("[gyro]"))) << draft;
  EXPECT_THAT(text("yours/robot.toml"), Not(HasSubstr("[gyro]")));
  EXPECT_THAT(draft, HasSubstr("columns.x_m = { column = \"X (mm)\", unit = \"mm\" }"));
  EXPECT_THAT(draft, HasSubstr("columns.heading_rad = { column = \"Yaw (deg)\", unit = \"deg\" }"));
}

TEST_F(Init, StampsThatAreNoNumbersAreToBeFilledIn) {
  std::string dated = "date,left_ticks,right_ticks\n", steady = "t,left_rpm,right_rpm\n";
  for (int row = 0; row < 60; ++row) {
    dated += fmt::format("2024-01-01T00:00:{:02},{},{}\n", row, 10 * row, 11 * row);
    steady += fmt::format("{},5,6\n", 0.1 * row);
  }
  put("dated/log.csv", dated);
  const Outcome drafted = run({"init", "dated", "-o", "mine"});
  ASSERT_EQ(drafted.exit_code, 0) << drafted.err;
  EXPECT_THAT(drafted.out, HasSubstr("no column of its table rises as stamps do"));
  EXPECT_THAT(text("mine/recording.toml"), HasSubstr("# columns.time_s =    # TO FILL IN"));
  // A rate that stays the same moves all the while.
  put("steady/log.csv", steady);
  EXPECT_THAT(run({"init", "steady", "-o", "yours"}).out, Not(HasSubstr("none of them moves")));
}

TEST_F(Init, WhereNothingIsRecognisedNoRunIsAdvised) {
  put("empty/data.csv", "a,b\n1,2\n3,4\n");
  const Outcome drafted = run({"init", "empty", "-o", "mine"});
  EXPECT_EQ(drafted.exit_code, 0);
  EXPECT_THAT(drafted.out, Not(HasSubstr("trundle run")));
}

/// As robots' packages write them: Husky's leaves its wheels to the URDF, TurtleBot 3 has a node of its own.
TEST_F(Init, ControllersOfSeveralRobotsAreUnderstood) {
  put("drive/log.csv", table());
  put("robot.urdf", kUrdf);
  put("husky.yaml", R"(husky_velocity_controller:
  type: "diff_drive_controller/DiffDriveController"
  left_wheel: ['front_left_wheel', 'rear_left_wheel']
  right_wheel: ['front_right_wheel', 'rear_right_wheel']
  publish_rate: 50
  pose_covariance_diagonal: [0.001, 0.001, 0.001, 0.001, 0.001, 0.03]
  cmd_vel_timeout: 0.25
  # Wheel separation and radius multipliers
  wheel_separation_multiplier: 1.875 # default: 1.0
  linear:
    x:
      max_velocity: 1.0   # m/s
)");
  put("burger.yaml", R"(/**:
  turtlebot3_node:
    ros__parameters:
      wheels:
        separation: 0.160
        radius: 0.033
      motors:
        profile_acceleration_constant: 214.577
      sensors:
        bumper_1: false
)");
  put("two.yaml", "a:\n  wheel_radius: 0.1\n  wheel_separation: 0.5\nb:\n  wheel_radius: 0.2\n");
  ASSERT_EQ(
      run({"init", "drive", "--urdf", "robot.urdf", "--controller", "husky.yaml", "-o", "husky"}).exit_code,
      0);
  EXPECT_THAT(text("husky/robot.toml"),
              HasSubstr("name = \"left\"\nx_m = 0.1\ny_m = 0.46875\ndiameter_m = 0.2\n"));
  ASSERT_EQ(run({"init", "drive", "--controller", "burger.yaml", "-o", "burger"}).exit_code, 0);
  EXPECT_THAT(text("burger/robot.toml"), HasSubstr("y_m = -0.08\ndiameter_m = 0.066\n"));
  const Outcome two = run({"init", "drive", "--controller", "two.yaml", "-o", "two"});
  EXPECT_EQ(two.exit_code, 3);
  EXPECT_THAT(two.err, HasSubstr("wheel_radius is there twice, as 0.1 and 0.2"));
}

/// As xacro expands a robot's description: wheels below a footprint, meshes, casters that turn without end,
/// too.
TEST_F(Init, AUrdfAsXacroWritesItGivesWheelsAloneByTheirJoints) {
  put("drive/log.csv", table());
  put("robot.urdf", R"(<?xml version="1.0" ?>
<!-- =================================================================================== -->
<!-- |    This document was autogenerated by xacro from rover.urdf.xacro                | -->
<robot name="rover">
  <material name="light black"><color rgba="0.4 0.4 0.4 1.0"/></material>
  <link name="base_footprint"/>
  <joint name="base_joint" type="fixed">
    <parent link="base_footprint"/><child link="base_link"/>
    <origin rpy="0 0 0" xyz="0 0 0.010"/>
  </joint>
  <link name="base_link">
    <visual><geometry><mesh filename="package://rover/meshes/base.stl" scale="0.001 0.001 0.001"/></geometry></visual>
    <collision><geometry><box size="0.140 0.140 0.143"/></geometry></collision>
  </link>
  <joint name="wheel_left_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_left_link"/>
    <origin rpy="-1.57 0 0" xyz="0.0 0.08 0.023"/><axis xyz="0 0 1"/>
  </joint>
  <link name="wheel_left_link">
    <visual><origin rpy="1.57 0 0" xyz="0 0 0"/><geometry><mesh filename="package://rover/left.stl"/></geometry></visual>
    <collision><geometry><cylinder length="0.018" radius="0.033"/></geometry></collision>
    <inertial><mass value="2.8498940e-02"/><inertia ixx="1.1175580e-05" ixy="0" ixz="0" iyy="1.1192413e-05" iyz="0" izz="2.0712558e-05"/></inertial>
  </link>
  <joint name="wheel_right_joint" type="continuous">
    <parent link="base_link"/><child link="wheel_right_link"/>
    <origin rpy="-1.57 0 0" xyz="0.0 -0.080 0.023"/><axis xyz="0 0 1"/>
  </joint>
  <link name="wheel_right_link"><collision><geometry><cylinder length="0.018" radius="0.033"/></geometry></collision></link>
  <joint name="caster_back_joint" type="continuous">
    <parent link="base_link"/><child link="caster_back_link"/><origin xyz="-0.081 0 -0.004"/>
  </joint>
  <link name="caster_back_link"><collision><geometry><sphere radius="0.005"/></geometry></collision></link>
  <gazebo><plugin filename="libgazebo_ros_diff_drive.so" name="drive"><wheel_separation>0.16</wheel_separation></plugin></gazebo>
  <transmission name="left"><joint name="wheel_left_joint"><hardwareInterface>x</hardwareInterface></joint></transmission>
</robot>
)");
  const Outcome outcome = run({"init", "drive", "--urdf", "robot.urdf", "-o", "draft"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, Not(HasSubstr("to fill in")));
  const std::string robot = text("draft/robot.toml");
  EXPECT_THAT(robot, HasSubstr("name = \"left\"\nx_m = 0\ny_m = 0.08\ndiameter_m = 0.066\n"));
  EXPECT_THAT(robot, HasSubstr("name = \"right\"\nx_m = 0\ny_m = -0.08\ndiameter_m = 0.066\n"));
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
