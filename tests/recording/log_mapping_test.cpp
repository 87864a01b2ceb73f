#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/recording.hpp"

#include "../logs/packed_writers.hpp"
#include "../logs/ros_writers.hpp"
#include "../real_data.hpp"
#include "folder.hpp"

namespace trundle::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr const char* kHeader = "\n===\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n";
constexpr const char* kVector = "\n===\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";

/// With a stamp so many milliseconds after the epoch of the tests.
RosBytes stamped(int milliseconds) {
  RosBytes bytes;
  bytes.put(std::uint32_t{0}).put(static_cast<std::uint32_t>(1'700'000'000 + milliseconds / 1000));
  return bytes.put(static_cast<std::uint32_t>(milliseconds % 1000 * 1'000'000)).text("base");
}

std::int64_t recorded(int milliseconds) {
  return 1'700'000'000 * kSecond_ns + std::int64_t{milliseconds} * 1'000'000;
}

WrittenChannel joint_states() {
  return {"/joint_states", "sensor_msgs/JointState",
          std::string("Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n") + kHeader};
}

std::string joint_state(int milliseconds, std::initializer_list<std::pair<const char*, double>> joints) {
  RosBytes bytes = stamped(milliseconds);
  bytes.put(static_cast<std::uint32_t>(joints.size()));
  for (const auto& joint : joints) bytes.text(joint.first);
  bytes.put(static_cast<std::uint32_t>(joints.size()));
  for (const auto& joint : joints) bytes.put(joint.second);
  return bytes.put(std::uint32_t{0}).bytes();
}

WrittenChannel imu() {
  return {"/imu", "sensor_msgs/Imu",
          std::string("Header header\ngeometry_msgs/Vector3 angular_velocity\ngeometry_msgs/Vector3 "
                      "linear_acceleration\n") +
              kHeader + kVector};
}

std::string imu_message(int milliseconds, std::array<double, 3> rate, std::array<double, 3> acceleration) {
  RosBytes bytes = stamped(milliseconds);
  for (const double value : rate) bytes.put(value);
  for (const double value : acceleration) bytes.put(value);
  return bytes.bytes();
}

/// Where the other frame is, seen from that of the reference's pose.
Pose2 inverse_of_pose(const ReferenceStream& reference, std::size_t row) {
  return Pose2{reference.x_m[row], reference.y_m[row], reference.heading_rad[row]}.inverse();
}

/// A recording of one log and a recording.toml.
class LogRecording {
 public:
  LogRecording(const WrittenLog& log, std::string_view map) {
    folder_.write("run.bag", bag_of(log));
    folder_.write("recording.toml", map);
  }
  Recording read() const { return read_recording(folder_.path()); }
  std::string complaint() const {
    try {
      (void)read();
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  }
  const Folder& folder() const { return folder_; }

 private:
  Folder folder_;
};

std::vector<FindingCode> codes_of(const Recording& recording) {
  std::vector<FindingCode> codes;
  for (const Finding& finding : recording.findings) codes.push_back(finding.code);
  return codes;
}

WrittenLog driving_log() {
  WrittenLog log{.channels = {joint_states(), imu()}, .messages = {}};
  for (int i = 0; i < 4; ++i) {
    log.messages.push_back({0, recorded(100 * i + 5),
                            joint_state(100 * i, {{"arm", 9.0}, {"left", 0.5 * i}, {"right", 0.25 * i}})});
    log.messages.push_back(
        {0, recorded(100 * i + 6), joint_state(100 * i, {{"gripper", 1.0}})});  // another publisher
    log.messages.push_back(
        {1, recorded(100 * i + 7), imu_message(100 * i, {0.1, -0.2, 0.3}, {0.2, -9.7, 0.4})});
  }
  return log;
}

constexpr const char* kDriving = R"(time_origin = "first"
[wheels]
file = "run.bag"
topic = "/joint_states"
columns.left_rad = "position[joint=left]"
columns.right_rad = { field = "position[name=right]", sign = -1 }
[gyro]
file = "run.bag"
topic = "/imu"
)";

/// An Imu that publishes its orientation alone turns 1 rad in each of three tenths of a second, over ±π and,
/// in one of them, without a word.
TEST(LogMapping, rates_of_a_gyro_that_gives_angles_alone) {
  WrittenLog log{
      .channels = {joint_states(),
                   {"/imu", "sensor_msgs/Imu",
                    std::string("Header header\ngeometry_msgs/Quaternion orientation\n") + kHeader +
                        "\n===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\n"
                        "float64 w\n"}},
      .messages = {}};
  for (int i = 0; i < 4; ++i) {
    log.messages.push_back(
        {0, recorded(100 * i), joint_state(100 * i, {{"left", 0.5 * i}, {"right", 0.25 * i}})});
    const double half = i == 2 ? 0.0 : 0.5 * (2.5 + i);
    RosBytes bytes = stamped(100 * i);
    bytes.put(0.0).put(0.0).put(std::sin(half)).put(i == 2 ? 0.0 : std::cos(half));
    log.messages.push_back({1, recorded(100 * i), bytes.bytes()});
  }
  const std::string map(kDriving);
  const Recording recording = LogRecording(log, map + "columns.yaw_rad = \"orientation.yaw\"\n").read();
  const std::vector<double>& rates = recording.gyro.yaw_rate_rad_s;
  ASSERT_EQ(rates.size(), 4U);
  EXPECT_TRUE(std::isnan(rates[0]));
  for (const std::size_t i : {1, 2, 3}) EXPECT_NEAR(rates[i], 10.0, 1e-6) << i;
  EXPECT_THAT(LogRecording(log, map + "columns.yaw_rad = \"orientation.yaw\"\n"
                                      "columns.yaw_rate_rad_s = \"orientation.z\"\n")
                  .complaint(),
              HasSubstr("gives yaw_rad besides yaw_rate_rad_s"));
}

/// Of a table the same, in degrees and counted on.
TEST(LogMapping, angles_of_a_table_become_rates) {
  const Folder folder;
  folder.write("heading.csv", "t,deg\n0,350\n0.1,359\n0.2,8\n0.4,8\n");
  folder.write("recording.toml",
               "[gyro]\nfile = \"heading.csv\"\ncolumns.time_s = \"t\"\n"
               "columns.yaw_rad = { column = \"deg\", unit = \"deg\", sign = -1 }\n");
  const Recording recording = read_recording(folder.path());
  const std::vector<double>& rates = recording.gyro.yaw_rate_rad_s;
  ASSERT_EQ(rates.size(), 4U);
  EXPECT_NEAR(rates[1], -radians(90.0), 1e-9);
  EXPECT_NEAR(rates[2], -radians(90.0), 1e-9);
  EXPECT_NEAR(rates[3], 0.0, 1e-9);
}

TEST(LogMapping, joints_and_the_axis_that_points_up) {
  const Recording recording = LogRecording(driving_log(), kDriving).read();
  ASSERT_EQ(recording.wheels.series.size(), 2U);
  EXPECT_THAT(recording.wheels.series[0].value, ElementsAre(0.0, 0.5, 1.0, 1.5));
  EXPECT_THAT(recording.wheels.series[1].value, ElementsAre(0.0, -0.25, -0.5, -0.75));
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0.0, 0.1, 0.2, 0.3));
  EXPECT_THAT(recording.gyro.yaw_rate_rad_s, ElementsAre(0.2, 0.2, 0.2, 0.2));  // about -y
  EXPECT_THAT(codes_of(recording),
              ElementsAre(FindingCode::log_stamps, FindingCode::log_stamps, FindingCode::gyro_axis));
  EXPECT_THAT(describe(recording.findings[0]), HasSubstr("recorded 0.005 s after"));
  EXPECT_THAT(describe(recording.findings[2]), HasSubstr("-y, the axis that points up by the accelerometer"));
  EXPECT_THAT(recording.wheels.origin.place_of(1), HasSubstr("run.bag /joint_states:3"));
}

TEST(LogMapping, a_log_is_a_recording_by_the_map_beside_it_or_the_one_given) {
  const LogRecording driving(driving_log(), kDriving);
  const Recording beside = read_recording(driving.folder() / "run.bag");
  EXPECT_EQ(beside.name, "run");
  EXPECT_EQ(beside.session, "run");
  EXPECT_EQ(beside.wheels.time_s, driving.read().wheels.time_s);
  const Folder elsewhere;
  const auto log = elsewhere.write("other.bag", bag_of(driving_log()));
  EXPECT_THROW((void)read_recording(log), InputError);
  const Recording given = read_recording(log, {.map = (driving.folder() / "recording.toml").string()});
  EXPECT_EQ(given.wheels.time_s, beside.wheels.time_s);
  EXPECT_THAT(given.inputs.back().path, HasSubstr("other.bag"));
  EXPECT_EQ(recordings_below(log), std::vector{log});
}

TEST(LogMapping, the_logs_time_where_it_is_asked_for_or_headers_hold_none) {
  WrittenLog log{.channels = {joint_states()}, .messages = {}};
  for (int i = 0; i < 3; ++i) log.messages.push_back({0, recorded(10 * i), joint_state(0, {{"left", 1.0}})});
  const std::string map =
      "[wheels]\nfile = \"run.bag\"\ntopic = \"/joint_states\"\ncolumns.left_rad = \"position[0]\"\n";
  EXPECT_THAT(LogRecording(log, "time_origin = 1700000000\n" + map + "columns.time_s = \"log_time\"\n")
                  .read()
                  .wheels.time_s,
              ElementsAre(0.0, 0.01, 0.02));
  for (WrittenMessage& message : log.messages)
    message.bytes =
        RosBytes().put(std::uint32_t{0}).put(std::uint64_t{0}).raw(message.bytes.substr(12)).bytes();
  const Recording recording = LogRecording(log, "time_origin = \"first\"\n" + map).read();
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0.0, 0.01, 0.02));
  EXPECT_THAT(describe(recording.findings.front()), HasSubstr("hold no stamps"));
}

/// A simulation's clock, which began at 0 and is slower.
TEST(LogMapping, stamps_of_another_clock_are_said_to_be_it) {
  WrittenLog log{.channels = {joint_states()}, .messages = {}};
  for (int i = 0; i < 3; ++i)
    log.messages.push_back(
        {0, recorded(1000 * i) + 400'000'000 * kSecond_ns, joint_state(600 * i, {{"left", 1.0}})});
  const Recording recording =
      LogRecording(
          log,
          "[wheels]\nfile = \"run.bag\"\ntopic = \"/joint_states\"\ncolumns.left_rad = \"position[0]\"\n")
          .read();
  EXPECT_THAT(describe(recording.findings.front()),
              HasSubstr("of another clock than the log's, against which it runs up to 0.4 s"));
}

TEST(LogMapping, columns_of_several_topics_hold_their_last_value) {
  WrittenLog log{.channels = {{"/left", "std_msgs/Float64", "float64 data\n"},
                              {"/right", "std_msgs/Float64", "float64 data\n"},
                              {"/cycle", "std_msgs/Float64", "float64 data\n"}},
                 .messages = {}};
  const auto write = [&](std::uint32_t channel, int milliseconds, double value) {
    log.messages.push_back({channel, recorded(milliseconds), RosBytes().put(value).bytes()});
  };
  write(0, 0, 1.0);
  write(2, 0, 0.0);
  write(2, 20, 0.0);  // right is not known yet
  write(1, 20, 5.0);
  write(2, 40, 0.0);
  write(0, 40, 2.0);  // within the cycle, after its clock
  write(2, 60, 0.0);
  const std::string columns =
      "columns.left_m = { topic = \"/left\", field = \"data\" }\ncolumns.right_m = { topic = \"/right\", "
      "field = "
      "\"data\" }\n";
  const std::string head = "time_origin = \"first\"\n[wheels]\nfile = \"run.bag\"\n";
  const Recording cycles = LogRecording(log, head + "topic = \"/cycle\"\n" + columns).read();
  EXPECT_THAT(cycles.wheels.time_s, ElementsAre(0.02, 0.04, 0.06));  // once all are known
  EXPECT_THAT(cycles.wheels.series[0].value, ElementsAre(1.0, 2.0, 2.0));
  EXPECT_THAT(cycles.wheels.series[1].value, ElementsAre(5.0, 5.0, 5.0));
  write(0, 80, 3.0);
  write(1, 81, 6.0);  // of the same cycle
  write(0, 82, 4.0);  // of the next
  const Recording changes = LogRecording(log, head + columns).read();
  EXPECT_THAT(changes.wheels.series[0].value, ElementsAre(1.0, 2.0, 3.0, 4.0));
  EXPECT_THAT(changes.wheels.series[1].value, ElementsAre(5.0, 5.0, 6.0, 6.0));
}

// ---- Poses ----

WrittenChannel odometry() {
  return {
      "/odom", "nav_msgs/Odometry",
      std::string("Header header\nPoses pose\nTwists twist\n") + kHeader + kVector +
          "===\nMSG: nav_msgs/Poses\nPose pose\n===\nMSG: nav_msgs/Pose\ngeometry_msgs/Vector3 "
          "position\nQuaternion "
          "orientation\n===\nMSG: nav_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n===\nMSG: "
          "nav_msgs/Twists\nTwist twist\n===\nMSG: nav_msgs/Twist\ngeometry_msgs/Vector3 "
          "linear\ngeometry_msgs/Vector3 angular\n"};
}

std::string odometry_message(int milliseconds, double x, double y, double heading) {
  RosBytes bytes = stamped(milliseconds);
  bytes.put(x).put(y).put(0.0).put(0.0).put(0.0).put(std::sin(heading / 2)).put(std::cos(heading / 2));
  return bytes.put(1.5).put(0.0).put(0.0).put(0.0).put(0.0).put(-0.5).bytes();
}

TEST(LogMapping, odometry_gives_velocity_reference_and_rebuilt_wheels) {
  // A left wheel that stands while the right one rolls a quarter of a circle, in steps of arcs; then 1 m
  // back.
  constexpr double kTrack_m = 0.4;
  WrittenLog log{.channels = {odometry()}, .messages = {}};
  constexpr int kSteps = 10;
  double heading = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    heading = kPi / 2 * i / kSteps;
    const double radius = kTrack_m / 2;
    log.messages.push_back(
        {0, recorded(100 * i),
         odometry_message(100 * i, radius * std::sin(heading), radius * (1 - std::cos(heading)), heading)});
  }
  log.messages.push_back(
      {0, recorded(1100), odometry_message(1100, kTrack_m / 2, kTrack_m / 2 - 1.0, heading)});
  const Recording recording =
      LogRecording(
          log,
          "[velocity]\nfile = \"run.bag\"\ntopic = \"/odom\"\n[reference]\nfile = \"run.bag\"\ntopic = "
          "\"/odom\"\n[wheels]\nfile = \"run.bag\"\ntopic = \"/odom\"\nrebuild = { wheel_separation_m = 0.4, "
          "right "
          "= \"starboard\" }\n")
          .read();
  EXPECT_EQ(recording.velocity.forward_m_s.front(), 1.5);
  EXPECT_EQ(recording.velocity.yaw_rate_rad_s.front(), -0.5);
  EXPECT_NEAR(recording.reference.heading_rad.back(), kPi / 2, 1e-12);
  ASSERT_EQ(recording.wheels.series.size(), 2U);
  EXPECT_EQ(recording.wheels.series[1].wheel, "starboard");
  EXPECT_EQ(recording.wheels.series[1].unit, WheelUnit::metres);
  EXPECT_NEAR(recording.wheels.series[0].value[kSteps], 0.0, 1e-12);
  EXPECT_NEAR(recording.wheels.series[1].value[kSteps], kTrack_m * kPi / 2, 1e-12);
  EXPECT_NEAR(recording.wheels.series[0].value.back(), -1.0, 1e-12);
  EXPECT_THAT(codes_of(recording), testing::Contains(FindingCode::rebuilt_wheels));
}

TEST(LogMapping, a_pair_of_frames_is_a_reference) {
  WrittenLog log{
      .channels = {{"/tf", "tf2_msgs/TFMessage",
                    std::string("geometry_msgs/TransformStamped[] transforms\n===\nMSG: "
                                "geometry_msgs/TransformStamped\nHeader header\nstring "
                                "child_frame_id\nTransform transform\n===\nMSG: "
                                "geometry_msgs/Transform\nVector3 translation\nQuaternion "
                                "rotation\n===\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 "
                                "z\nfloat64 w\n") +
                        kHeader + kVector}},
      .messages = {}};
  const auto transform = [](int milliseconds, const char* child, double x) {
    RosBytes bytes = stamped(milliseconds);  // its frame is "base"
    return bytes.text(child).put(x).put(2.0).put(0.0).put(0.0).put(0.0).put(0.0).put(1.0).bytes();
  };
  for (int i = 0; i < 3; ++i) {
    log.messages.push_back({0, recorded(50 * i),
                            RosBytes()
                                .put(std::uint32_t{2})
                                .raw(transform(50 * i, "wheel", 7.0))
                                .raw(transform(50 * i, "camera", i))
                                .bytes()});
    log.messages.push_back({0, recorded(50 * i + 9),
                            RosBytes().put(std::uint32_t{1}).raw(transform(50 * i, "wheel", 8.0)).bytes()});
  }
  const Recording recording =
      LogRecording(log, "[reference]\nfile = \"run.bag\"\ntopic = \"/tf\"\nframes = [\"base\", \"camera\"]\n")
          .read();
  EXPECT_THAT(recording.reference.x_m, ElementsAre(0.0, 1.0, 2.0));
  EXPECT_THAT(recording.reference.heading_rad, ElementsAre(0.0, 0.0, 0.0));
}

// ---- Chains of frames ----

WrittenChannel transforms(const char* topic) {
  return {
      topic, "tf2_msgs/TFMessage",
      std::string("geometry_msgs/TransformStamped[] transforms\n===\nMSG: geometry_msgs/TransformStamped\n"
                  "Header header\nstring child_frame_id\nTransform transform\n===\nMSG: "
                  "geometry_msgs/Transform\nVector3 translation\nQuaternion rotation\n===\nMSG: "
                  "geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n") +
          kHeader + kVector};
}

struct WrittenTransform {
  const char *parent, *child;
  double x_m, y_m, yaw_rad;
  double roll_rad = 0.0;
};

/// One message of one transform: Rz(yaw) Rx(roll).
std::string transform_message(int milliseconds, const WrittenTransform& t) {
  const double cz = std::cos(t.yaw_rad / 2), sz = std::sin(t.yaw_rad / 2), cx = std::cos(t.roll_rad / 2),
               sx = std::sin(t.roll_rad / 2);
  RosBytes bytes;
  bytes.put(std::uint32_t{1}).put(std::uint32_t{0});
  bytes.put(static_cast<std::uint32_t>(1'700'000'000 + milliseconds / 1000));
  bytes.put(static_cast<std::uint32_t>(milliseconds % 1000 * 1'000'000)).text(t.parent).text(t.child);
  bytes.put(t.x_m).put(t.y_m).put(0.0);
  return bytes.put(cz * sx).put(sz * sx).put(sz * cx).put(cz * cx).bytes();
}

/// A robot that drives a circle in `odom`, which drifts in `map`; a mast on it that is mounted turned by 90°.
WrittenLog driving_frames() {
  WrittenLog log{.channels = {transforms("/tf"), transforms("/tf_static")}, .messages = {}};
  log.messages.push_back({1, recorded(0), transform_message(0, {"base_link", "mast", 0.1, 0.2, kPi / 2})});
  for (int i = 0; i <= 100; ++i) {
    if (i % 20 == 0)  // seldom, and its stamps are none of the others
      log.messages.push_back({0, recorded(10 * i),
                              transform_message(10 * i + 5, {"/map", "/odom", 0.002 * (10 * i + 5), 1.0,
                                                             0.001 * (10 * i + 5)})});
    const double heading = 0.01 * i;
    log.messages.push_back({0, recorded(10 * i),
                            transform_message(10 * i, {"odom", "base_link", 2.0 * std::sin(heading),
                                                       2.0 - 2.0 * std::cos(heading), heading})});
  }
  return log;
}

TEST(LogMapping, a_chain_of_frames_is_composed_at_the_stamps_of_the_one_that_comes_most_often) {
  const std::string map =
      "time_origin = 1700000000\n[reference]\nfile = \"run.bag\"\ntopic = \"/tf\"\nframes = ";
  const Recording recording = LogRecording(driving_frames(), map + "[\"map\", \"mast\"]\n").read();
  const ReferenceStream& reference = recording.reference;
  ASSERT_EQ(reference.time_s.size(), 100U);  // not before the first of map -> odom, at 5 ms
  for (std::size_t row = 0; row < reference.time_s.size(); ++row) {
    const double t_s = reference.time_s[row], heading = t_s, drift_rad = t_s;
    const Pose2 map_from_odom{2.0 * t_s, 1.0, drift_rad};
    const Pose2 odom_from_base{2.0 * std::sin(heading), 2.0 - 2.0 * std::cos(heading), heading};
    const Pose2 expected = map_from_odom * odom_from_base * Pose2{0.1, 0.2, kPi / 2};
    EXPECT_NEAR(reference.x_m[row], expected.x, 1e-9) << t_s;
    EXPECT_NEAR(reference.y_m[row], expected.y, 1e-9) << t_s;
    EXPECT_NEAR(wrap_angle(reference.heading_rad[row] - expected.heading), 0.0, 1e-9) << t_s;
  }
  EXPECT_THAT(codes_of(recording), ElementsAre(FindingCode::log_stamps));
  // Against the arrows, too: where odom is, seen from the mast.
  const Recording inverse = LogRecording(driving_frames(), map + "[\"mast\", \"odom\"]\n").read();
  const Pose2 first = inverse_of_pose(inverse.reference, 0);
  EXPECT_NEAR(first.x, 0.1, 1e-9);
  EXPECT_NEAR(first.y, 0.2, 1e-9);
}

TEST(LogMapping, frames_that_are_not_connected_or_do_not_move_are_refused) {
  const auto complaint = [](const std::string& frames) {
    return LogRecording(driving_frames(),
                        "[reference]\nfile = \"run.bag\"\ntopic = \"/tf\"\nframes = " + frames + "\n")
        .complaint();
  };
  EXPECT_THAT(
      complaint("[\"map\", \"camera\"]"),
      HasSubstr("recording.toml:4: 'map' and 'camera' are not connected by the transforms of /tf; expected "
                "frames of one tree: odom -> base_link, base_link -> mast, map -> odom"));
  EXPECT_THAT(complaint("[\"base_link\", \"mast\"]"), HasSubstr("do not move against each other"));
  EXPECT_THAT(complaint("[\"map\"]"), HasSubstr("frames is no pair"));
}

/// Mounted on its side and 30° off: the rate about the body's vertical is a mixture of two axes.
TEST(LogMapping, the_mounting_of_a_gyro_is_that_of_the_static_transforms) {
  WrittenLog log{.channels = {imu(), transforms("/tf_static")}, .messages = {}};
  for (int i = 0; i < 3; ++i)
    log.messages.push_back({0, recorded(10 * i), imu_message(10 * i, {5.0, 0.6, 0.8}, {0.0, 9.8, 0.0})});
  const double roll = radians(60.0);
  log.messages.push_back({1, recorded(30), transform_message(0, {"base_link", "deck", 1.0, 0.0, 0.3})});
  log.messages.push_back({1, recorded(30), transform_message(0, {"deck", "base", 0.0, 0.0, 0.0, roll})});
  const std::string map = "[gyro]\nfile = \"run.bag\"\ntopic = \"/imu\"\nbody_frame = ";
  const Recording recording = LogRecording(log, map + "\"base_link\"\n").read();
  for (const double rate : recording.gyro.yaw_rate_rad_s)
    EXPECT_NEAR(rate, 0.6 * std::sin(roll) + 0.8 * std::cos(roll), 1e-12);
  EXPECT_THAT(describe(recording.findings.back()), HasSubstr("the transform from base_link to base"));
  EXPECT_THAT(LogRecording(log, map + "\"chassis\"\n").complaint(),
              HasSubstr("'chassis' and 'base' are not connected"));
}

TEST(LogMapping, fixes_are_metres_east_and_north_of_the_first) {
  WrittenLog log{.channels = {{"/fix", "sensor_msgs/NavSatFix",
                               std::string("Header header\nNavSatStatus status\nfloat64 latitude\nfloat64 "
                                           "longitude\n===\nMSG: sensor_msgs/NavSatStatus\nint8 status\n") +
                                   kHeader}},
                 .messages = {}};
  const auto fix = [&](int milliseconds, std::int8_t status, double latitude, double longitude) {
    log.messages.push_back(
        {0, recorded(milliseconds), stamped(milliseconds).put(status).put(latitude).put(longitude).bytes()});
  };
  fix(0, -1, 0.0, 0.0);  // no fix
  fix(1000, 0, 48.0, 11.0);
  fix(2000, 0, 48.001, 11.0);
  fix(3000, 0, 48.0, 11.001);
  const Recording recording = LogRecording(log, "[reference]\nfile = \"run.bag\"\ntopic = \"/fix\"\n").read();
  ASSERT_EQ(recording.reference.x_m.size(), 3U);
  EXPECT_EQ(recording.reference.x_m[0], 0.0);
  // A thousandth of a degree along the meridian and the parallel: radii a (1 - e²) / (1 - e² sin² φ)^3/2 and
  // a cos φ / (1 - e² sin² φ)^1/2.
  EXPECT_NEAR(recording.reference.y_m[1], 111.190, 0.001);
  EXPECT_NEAR(recording.reference.x_m[2], 74.625, 0.001);
  EXPECT_TRUE(std::isnan(recording.reference.heading_rad[1]));
}

TEST(LogMapping, each_detection_of_an_array_is_a_sighting) {
  WrittenLog log{
      .channels = {{"/tags", "a/Detections",
                    std::string("Header header\nDetection[] detections\n===\nMSG: a/Detection\nint32 "
                                "id\ngeometry_msgs/Vector3 at\n") +
                        kHeader + kVector}},
      .messages = {}};
  RosBytes bytes = stamped(0);
  bytes.put(std::uint32_t{2});
  bytes.put(std::int32_t{4}).put(-3.0).put(0.0).put(4.0);  // optical frame: x to the right, z ahead
  bytes.put(std::int32_t{9}).put(0.0).put(0.0).put(2.0);
  log.messages.push_back({0, recorded(0), bytes.bytes()});
  log.messages.push_back({0, recorded(100), stamped(100).put(std::uint32_t{0}).bytes()});
  const Recording recording = LogRecording(log, R"([sightings]
file = "run.bag"
topic = "/tags"
columns.landmark = "detections[].id"
columns.x_m = "detections[].at.z"
columns.y_m = { field = "detections[].at.x", sign = -1 }
)")
                                  .read();
  ASSERT_EQ(recording.sightings.size(), 2U);
  EXPECT_EQ(recording.sightings[0].landmark, "4");
  EXPECT_NEAR(recording.sightings[0].range_m, 5.0, 1e-12);
  EXPECT_NEAR(recording.sightings[0].bearing_rad, std::atan2(3.0, 4.0), 1e-12);
  EXPECT_EQ(recording.sightings[1].landmark, "9");
}

TEST(LogMapping, a_clock_that_jumps_by_years_is_no_rest) {
  WpilogWriter log;
  const auto left = log.start("/left", "double");
  for (int i = 0; i < 20; ++i) {
    constexpr std::uint64_t kYears_us = 50'000'000'000'000;
    log.time_us = static_cast<std::uint64_t>(i) * 20'000 + (i < 10 ? 0 : kYears_us);
    log.record(left, bytes_of_number(0.1 * i));
  }
  const Folder folder;
  folder.write("run.wpilog", log.bytes());
  folder.write("recording.toml", "[wheels]\nfile = \"run.wpilog\"\ncolumns.left_m = { topic = \"/left\" }\n");
  EXPECT_EQ(read_recording(folder.path()).wheels.time_s.size(), 20U);
}

TEST(LogMapping, values_that_stand_where_they_change_hold_until_the_next) {
  WpilogWriter log;
  const auto left = log.start("/left", "double"), rate = log.start("/gyro", "double");
  const auto write = [&](std::uint32_t entry, int milliseconds, double value) {
    log.time_us = static_cast<std::uint64_t>(milliseconds) * 1000;
    log.record(entry, bytes_of_number(value));
  };
  for (int i = 0; i < 5; ++i) write(left, 20 * i, 0.1 * i);  // 0.4 m at 80 ms, then a rest of 0.42 s
  for (int i = 0; i < 5; ++i) write(left, 500 + 20 * i, 0.5 + 0.1 * i);
  const Folder folder;
  folder.write("run.wpilog", log.bytes());
  folder.write("recording.toml", "[wheels]\nfile = \"run.wpilog\"\ncolumns.left_m = { topic = \"/left\" }\n");
  const Recording recording = read_recording(folder.path());
  const std::vector<double>& time_s = recording.wheels.time_s;
  const std::vector<double>& way_m = recording.wheels.series.front().value;
  const auto at = [&](double wanted_s) {
    return static_cast<std::size_t>(std::ranges::lower_bound(time_s, wanted_s - 1e-9) - time_s.begin());
  };
  EXPECT_EQ(way_m[at(0.48)], 0.4);  // one step before it moves again
  EXPECT_EQ(way_m[at(0.50)], 0.5);
  for (std::size_t row = 1; row < time_s.size(); ++row) EXPECT_LT(time_s[row] - time_s[row - 1], 0.11);
  EXPECT_THAT(codes_of(recording), ElementsAre(FindingCode::held_values));
  // A rate of 1 rad/s from 0 to 0.5 s, and -1 from then on: the mean over the step before each row.
  for (const int milliseconds : {0, 20, 40}) write(rate, 600 + milliseconds, 1.0 + 1e-9 * milliseconds);
  write(rate, 1100, -1.0);
  write(rate, 1120, -1.5);
  folder.write("run.wpilog", log.bytes());
  folder.write("recording.toml",
               "[gyro]\nfile = \"run.wpilog\"\ncolumns.yaw_rate_rad_s = { topic = \"/gyro\" }\n");
  const GyroStream gyro = read_recording(folder.path()).gyro;
  double turn = 0.0;
  for (std::size_t row = 1; row < gyro.time_s.size(); ++row)
    turn += gyro.yaw_rate_rad_s[row] * (gyro.time_s[row] - gyro.time_s[row - 1]);
  // What a row says was measured at its stamp: 0.48 s at 1 rad/s, then the two cycles of the other rates.
  EXPECT_NEAR(turn, 0.48 - 0.02 - 0.03, 1e-6);
}

/// The rate of a gyro that is written on change is what a table of all its cycles has: not one cycle later.
TEST(LogMapping, rates_that_are_written_on_change_stay_at_their_stamps) {
  WpilogWriter log;
  const auto rate = log.start("/gyro", "double");
  std::vector<double> written;
  for (int i = 0; i < 200; ++i) {
    const double value = i < 50 || i > 150 ? 0.0 : std::sin(0.05 * (i - 50));
    if (written.empty() || value != written.back()) {
      log.time_us = static_cast<std::uint64_t>(i) * 20'000;
      log.record(rate, bytes_of_number(value));
    }
    written.push_back(value);
  }
  const Folder folder;
  folder.write("run.wpilog", log.bytes());
  folder.write("recording.toml",
               "[gyro]\nfile = \"run.wpilog\"\ncolumns.yaw_rate_rad_s = { topic = \"/gyro\" }\n");
  const GyroStream gyro = read_recording(folder.path()).gyro;
  for (std::size_t row = 0; row < gyro.time_s.size(); ++row)
    EXPECT_EQ(gyro.yaw_rate_rad_s[row],
              written[static_cast<std::size_t>(std::lround(gyro.time_s[row] / 0.02 - 1e-6))])
        << gyro.time_s[row];
}

// ---- Faults ----

TEST(LogMapping, a_cut_that_is_empty_is_refused_as_of_a_table) {
  const LogRecording cut(driving_log(), R"([wheels]
file = "run.bag"
topic = "/joint_states"
start_s = 5
end_s = 2
columns.left_rad = "position[joint=left]"
columns.right_rad = "position[joint=right]"
)");
  EXPECT_THAT(cut.complaint(), HasSubstr("recording.toml:5: [wheels]: the cut from 5 s to 2 s is empty"));
}

TEST(LogMapping, what_leads_nowhere_is_refused_with_place_and_what_is_there) {
  const auto complaint = [](const std::string& map) { return LogRecording(driving_log(), map).complaint(); };
  const std::string wheels = "[wheels]\nfile = \"run.bag\"\n";
  EXPECT_THAT(complaint(wheels + "topic = \"/joint_state\"\n"),
              HasSubstr("has no topic '/joint_state'; expected '/joint_states'"));
  EXPECT_THAT(complaint(wheels + "topic = \"/joint_states\"\n"),
              HasSubstr("what they are in a sensor_msgs/JointState is not known"));
  EXPECT_THAT(complaint(wheels + "topic = \"/joint_states\"\ncolumns.left_rad = \"positions[0]\"\n"),
              HasSubstr("recording.toml:4: /joint_states: sensor_msgs/JointState has no field 'positions'; "
                        "expected 'position'"));
  EXPECT_THAT(complaint(wheels + "topic = \"/joint_states\"\ncolumns.left_rad = \"position[joint=lefd]\"\n"),
              HasSubstr("none of the 8 messages"));
  EXPECT_THAT(complaint(wheels + "topic = \"/joint_states\"\ncolumns.left_rad = \"name[0]\"\n"),
              HasSubstr("is a text"));
  EXPECT_THAT(complaint(wheels + "columns.left_rad = \"position\"\n"),
              HasSubstr("is a log, and no topic is named"));
  EXPECT_THAT(
      complaint(wheels + "topic = \"/joint_states\"\nheader = false\ncolumns.left_rad = \"position[0]\"\n"),
      HasSubstr("unknown key 'header'"));
  EXPECT_THAT(complaint(wheels + "topic = \"/joint_states\"\nrebuild = {}\n"),
              HasSubstr("wheel_separation_m"));
}

TEST(LogMapping, a_cut_log_gives_what_comes_before_and_says_so) {
  const std::string whole = bag_of(driving_log());
  const Folder folder;
  folder.write("recording.toml", kDriving);
  folder.write("run.bag", whole.substr(0, whole.size() * 3 / 5));
  const Recording recording = read_recording(folder.path());
  EXPECT_GE(recording.wheels.time_s.size(), 1U);
  EXPECT_LT(recording.wheels.time_s.size(), 4U);
  EXPECT_THAT(codes_of(recording), testing::Contains(FindingCode::log_cut));
}

// ---- A genuine one ----

constexpr const char* kHuskyBag = R"(time_origin = 1432235498
[gyro]
file = "{0}/test1.bag"
topic = "/imu/data"
[velocity]
file = "{0}/test1.bag"
topic = "/husky_velocity_controller/odom"
[reference]
file = "{0}/test1.bag"
topic = "/fix"
)";
constexpr const char* kHuskyTables = R"(time_origin = 1432235498
[gyro]
file = "{0}/imu_data.csv"
columns = {{ time_s = "stamp", yaw_rate_rad_s = "wy" }}
[velocity]
file = "{0}/husky_velocity_controller_odom.csv"
columns = {{ time_s = "stamp", forward_m_s = "vx", yaw_rate_rad_s = "wz" }}
[reference]
file = "{0}/fix.csv"
columns = {{ time_s = "stamp", latitude_deg = "lat_deg", longitude_deg = "lon_deg" }}
)";

void expect_same_digits(const std::vector<double>& bag, const std::vector<double>& table, double absolute) {
  ASSERT_EQ(bag.size(), table.size());
  constexpr double kNineDigits = 0.5e-8;  // of the tables
  for (std::size_t i = 0; i < bag.size(); ++i)
    ASSERT_NEAR(bag[i], table[i], absolute + kNineDigits * std::abs(bag[i])) << i;
}

TEST(LogMapping, a_genuine_bag_has_the_numbers_of_its_tables) {
  TRUNDLE_NEEDS_REAL_DATA("husky_gps_bag");
  const Folder bag_folder, table_folder;
  const std::string place = (real_data() / "husky_gps_bag").string();
  bag_folder.write("recording.toml", fmt::format(kHuskyBag, place));
  table_folder.write("recording.toml", fmt::format(kHuskyTables, place));
  const Recording bag = read_recording(bag_folder.path());
  const Recording tables = read_recording(table_folder.path());
  constexpr double kStamp_s = 2.5e-7;  // that a double had when the tables were written
  constexpr double kFix_m = 1e-5;      // ten decimals of a degree
  expect_same_digits(bag.gyro.time_s, tables.gyro.time_s, kStamp_s);
  expect_same_digits(bag.gyro.yaw_rate_rad_s, tables.gyro.yaw_rate_rad_s, 0.0);
  expect_same_digits(bag.velocity.time_s, tables.velocity.time_s, kStamp_s);
  expect_same_digits(bag.velocity.forward_m_s, tables.velocity.forward_m_s, 0.0);
  expect_same_digits(bag.velocity.yaw_rate_rad_s, tables.velocity.yaw_rate_rad_s, 0.0);
  expect_same_digits(bag.reference.time_s, tables.reference.time_s, kStamp_s);
  expect_same_digits(bag.reference.x_m, tables.reference.x_m, kFix_m);
  expect_same_digits(bag.reference.y_m, tables.reference.y_m, kFix_m);
}

}  // namespace
}  // namespace trundle::test
