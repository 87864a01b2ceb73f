#include "trundle/logs/definitions.hpp"

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

namespace trundle::test {
namespace {

using namespace logs;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* kRos1 = R"(# a comment
Header header
float64 rate  # of the wheel
int32 kLimit=5
string kName= a # is no comment here
int32[] counts
float32[3] fixed
geometry_msgs/Vector3[] points
string[] name
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
===
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
)";

TEST(LogDefinition, of_ros_1_has_every_field) {
  const Layout layout = parse_ros1msg("robot_msgs/Wheel", kRos1);
  EXPECT_THAT(layout.paths(), ElementsAre("header.seq", "header.stamp", "header.frame_id", "rate", "counts[]",
                                          "fixed[]", "points[].x", "points[].y", "points[].z", "name[]"));
  ASSERT_EQ(layout.root().constants.size(), 2U);
  EXPECT_EQ(layout.root().constants[0].value, "5");
  EXPECT_EQ(layout.root().constants[1].value, "a # is no comment here");
  EXPECT_EQ(layout.root().fields[3].count, 3U);
}

TEST(LogDefinition, of_ros_2_has_bounds_and_defaults) {
  const Layout layout = parse_ros2msg("robot_msgs/msg/Wheel", R"(
std_msgs/Header header
string<=10 label "a # in quotes"
float64[<=5] bounded
uint8 kConstant=3
Inner inner
builtin_interfaces/Duration[2] waits
===
MSG: robot_msgs/Inner
int16 value 7
)");
  EXPECT_THAT(layout.paths(),
              ElementsAre("header.stamp", "header.frame_id", "label", "bounded[]", "inner.value",
                          "waits[]"));  // Header and Duration are built in
}

TEST(LogDefinition, of_idl_has_the_fields_that_the_message_has) {
  const Layout layout = parse_ros2idl("robot_msgs/msg/Wheel", R"idl(
================================================================================
IDL: robot_msgs/msg/Wheel
// generated
#include "robot_msgs/msg/Inner.idl"
module robot_msgs {
  module msg {
    typedef double double__3[3];
    module Wheel_Constants { const uint8 ONE = 1; };
    @verbatim (language="comment", text="a \"quoted\" (text)")
    struct Wheel {
      std_msgs::msg::Header header;
      @unit (value="m")
      double__3 fixed;
      sequence<robot_msgs::msg::Inner, 4> inner;
      sequence<string> names;
      unsigned long long count;
      string<12> label;
      boolean a, b;
    };
  };
};
================================================================================
IDL: robot_msgs/msg/Inner
module robot_msgs { module msg { struct Inner { long value; octet raw[2]; }; }; };
)idl");
  EXPECT_THAT(layout.paths(), ElementsAre("header.stamp", "header.frame_id", "fixed[]", "inner[].value",
                                          "inner[].raw[]", "names[]", "count", "label", "a", "b"));
}

struct Refused {
  const char* name;
  std::string definition;
  const char* why;
};

class RefusedDefinition : public testing::TestWithParam<Refused> {};

TEST_P(RefusedDefinition, says_what_is_wrong) {
  try {
    (void)parse_ros1msg("a/Root", GetParam().definition);
    FAIL() << "it was read";
  } catch (const BadDefinition& error) {
    EXPECT_THAT(error.what(), HasSubstr(GetParam().why));
  }
}

std::string deep_definition() {
  std::string text = "T0 t\n";
  for (int i = 0; i < 1000; ++i) text += fmt::format("===\nMSG: a/T{}\nT{} t\n", i, i + 1);
  return text + "===\nMSG: a/T1000\nint8 x\n";
}

INSTANTIATE_TEST_SUITE_P(LogDefinition, RefusedDefinition,
                         testing::Values(Refused{"missing", "Other other\n", "a/Other is not defined"},
                                         Refused{"itself", "Root root\n", "contains itself"},
                                         Refused{"deep", deep_definition(), "nests deeper"},
                                         Refused{"no_name", "int8\n", "is no field"},
                                         Refused{"no_length", "int8[x] a\n", "is no type"}),
                         [](const auto& of) { return of.param.name; });

TEST(LogDefinition, that_doubles_at_each_level_is_walked_in_no_time) {
  std::string text = "T0 a\nT0 b\n";
  for (int i = 0; i < 28; ++i) text += fmt::format("===\nMSG: a/T{0}\nT{1} a\nT{1} b\n", i, i + 1);
  const Layout layout = parse_ros1msg("a/Root", text + "===\nMSG: a/T28\n");
  EXPECT_TRUE(layout.paths().empty());
  EXPECT_EQ(layout.least_size(static_cast<std::uint32_t>(layout.structures().size() - 1)), 0U);
}

TEST(LogDefinition, that_is_built_in_is_whole) {
  const Definitions definitions;
  for (const char* const type :
       {"nav_msgs/msg/Odometry", "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState",
        "tf2_msgs/msg/TFMessage", "sensor_msgs/msg/NavSatFix", "geometry_msgs/msg/PoseStamped",
        "visualization_msgs/msg/MarkerArray", "rcl_interfaces/msg/ParameterEvent",
        "std_msgs/msg/Float64MultiArray", "sensor_msgs/msg/PointCloud2"})
    EXPECT_FALSE(parse_ros2msg(type, definitions.find(type)).paths().empty()) << type;
  EXPECT_TRUE(definitions.find("somebody_else/msg/Type").empty());
}

TEST(LogDefinition, of_a_folder_goes_before_what_is_built_in) {
  const auto folder = std::filesystem::temp_directory_path() / "trundle_msg_path";
  std::filesystem::create_directories(folder / "my_msgs/msg");
  std::ofstream(folder / "my_msgs/msg/Wheel.msg") << "std_msgs/Header header\nInner inner\n";
  std::ofstream(folder / "my_msgs/msg/Inner.msg") << "int32 ticks\n";
  const Definitions definitions({folder});
  const Channel channel{.type = "my_msgs/msg/Wheel", .encoding = Encoding::cdr};
  EXPECT_THAT(layout_of(channel, definitions).paths(),
              ElementsAre("header.stamp", "header.frame_id", "inner.ticks"));
  EXPECT_THROW((void)layout_of(channel), BadDefinition);
  EXPECT_THROW(Definitions({folder / "nowhere"}), InputError);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace trundle::test
