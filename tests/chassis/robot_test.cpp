#include "trundle/chassis/robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/chassis/detail/robot_keys.hpp"
#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

#include "chassis/robots.hpp"
#include "chassis/same_robot.hpp"

namespace trundle::chassis {
namespace {

using namespace robot_file;
using test::same;
using testing::ElementsAre;

// --- reading

constexpr std::string_view kKobuki = R"(name = "kobuki"
icr_x_m = 0.01
[[wheel]]
name = "left"                  # names the column left_ticks
x_m = 0.0
y_m = 0.115
direction_deg = 0.0
kind = "fixed"
diameter_m = 0.0704
ticks_per_revolution = 2578.33
tick_bits = 16
recorded_diameter_m = 0.07
[[wheel]]
name = "right"
y_m = -0.115
direction_deg = 180
kind = "mecanum"
roller_deg = -4_5.0e0
diameter_m = 0.0704
ticks_per_revolution = -2578
[wheels]
time_offset_s = 0.02
[gyro]
bias_rad_s = 0.001
scale = -1.01
noise_rad_s_sqrt_hz = 0.0005
bias_walk_rad_s_sqrt_s = 2e-5
max_rate_rad_s = 5.0
time_offset_s = -0.01
[landmark_sensor]
x_m = 0.219
y_m = 0.1
heading_deg = 90
range_sigma_m = 0.03
bearing_sigma_deg = 1.8
max_range_m = 8.0
time_offset_s = 0.03
[noise]
wheel_per_sqrt_m = 0.011
lateral_per_sqrt_m = 0.002
skid_per_sqrt_m = 0.03
turn_per_sqrt_m = 0.04
turn_per_sqrt_rad = 0.05
[reference_sensor]
x_m = -0.1
y_m = 0.05
heading_deg = -90.0
time_offset_s = 0.5
)";

TEST(Robot, every_key_is_read) {
  const Robot robot = parse_robot(kKobuki, "robot.toml");
  EXPECT_EQ(robot.name, "kobuki");
  EXPECT_THAT(robot.wheel_names, ElementsAre("left", "right"));
  const Chassis& chassis = robot.chassis;
  ASSERT_EQ(chassis.wheel_count, 2);
  EXPECT_TRUE(same(chassis.wheels()[0], Wheel{.y_m = 0.115,
                                              .kind = WheelKind::fixed,
                                              .diameter_m = 0.0704,
                                              .ticks_per_revolution = 2578.33,
                                              .tick_bits = 16,
                                              .recorded_diameter_m = 0.07}));
  EXPECT_TRUE(same(chassis.wheels()[1], Wheel{.y_m = -0.115,
                                              .direction_rad = kPi,
                                              .kind = WheelKind::mecanum,
                                              .roller_rad = -0.25 * kPi,
                                              .diameter_m = 0.0704,
                                              .ticks_per_revolution = -2578}));
  EXPECT_EQ(chassis.icr_x_m, 0.01);
  EXPECT_EQ(chassis.wheels_time_offset_s, 0.02);
  EXPECT_TRUE(same(kGyro, *chassis.gyro, Gyro{0.001, -1.01, 0.0005, 2e-5, 5.0, -0.01}));
  EXPECT_TRUE(same(kLandmarkSensor, *robot.landmark_sensor,
                   LandmarkSensor{{0.219, 0.1, 0.5 * kPi}, 0.03, radians(1.8), 8.0, 0.03}));
  EXPECT_TRUE(same(kNoise, chassis.noise, ChassisNoise{0.011, 0.002, 0.03, 0.04, 0.05}));
  EXPECT_EQ(robot.body_from_reference.x, -0.1);
  EXPECT_EQ(robot.body_from_reference.heading, -0.5 * kPi);
  EXPECT_EQ(robot.reference_time_offset_s, 0.5);
  EXPECT_FALSE(robot.calibration);
}

TEST(Robot, the_sigma_of_the_bias_is_written_where_it_is_not_the_default) {
  const Robot robot = parse_robot("[gyro]\nbias_sigma_rad_s = 0.001\n", "r");
  EXPECT_EQ(robot.chassis.gyro->bias_sigma_rad_s, 0.001);
  EXPECT_NE(to_toml(robot).find("bias_sigma_rad_s = 0.001"), std::string::npos);
  EXPECT_EQ(to_toml(parse_robot("[gyro]\n", "r")).find("bias_sigma_rad_s"), std::string::npos);
}

TEST(Robot, a_wheel_may_have_a_noise_of_its_own) {
  const Robot robot = parse_robot(
      "[[wheel]]\nname = 'l'\ndiameter_m = 1\nnoise_per_sqrt_m = 0.02\n"
      "[[wheel]]\nname = 'r'\ndiameter_m = 1\n[noise]\nwheel_per_sqrt_m = 0.005\n",
      "r");
  EXPECT_EQ(wheel_noise(robot.chassis, 0), 0.02);
  EXPECT_EQ(wheel_noise(robot.chassis, 1), 0.005);
  EXPECT_NEAR(typical_wheel_noise(robot.chassis), std::sqrt((4e-4 + 25e-6) / 2.0), 1e-15);
  Chassis twice = robot.chassis;
  set_typical_wheel_noise(2.0 * typical_wheel_noise(twice), twice);
  EXPECT_NEAR(wheel_noise(twice, 0), 0.04, 1e-15);
  EXPECT_NEAR(wheel_noise(twice, 1), 0.01, 1e-15);
  // Its variance is that of its own row alone.
  const Rows rows = rows_of(robot.chassis, false);
  Increment increment;
  increment.turned = {1.0, 1.0};
  const RowVector variance = readings_of(robot.chassis, rows, increment).variance;
  EXPECT_NEAR(variance[0], 4e-4 * kPi, 1e-9);
  EXPECT_NEAR(variance[1], 25e-6 * kPi, 1e-9);
}

TEST(Robot, what_is_missing_has_its_default) {
  const Robot robot = parse_robot("[[wheel]]\nname = 'l'\ndiameter_m = 1\n[gyro]\n[landmark_sensor]\n", "r");
  EXPECT_EQ(robot.name, "");
  EXPECT_TRUE(same(robot.chassis.wheels()[0], Wheel{.diameter_m = 1.0}));
  EXPECT_TRUE(same(kGyro, *robot.chassis.gyro, Gyro{}));
  EXPECT_TRUE(same(kLandmarkSensor, *robot.landmark_sensor, LandmarkSensor{}));
  EXPECT_TRUE(same(kNoise, robot.chassis.noise, ChassisNoise{}));
}

TEST(Robot, a_file_without_wheels_is_a_robot_of_a_velocity_stream) {
  for (const char* text : {"", "name = 'x'\n", "[noise]\nwheel_per_sqrt_m = 0.02\n", "wheel = []\n"}) {
    const Robot robot = parse_robot(text, "robot.toml");
    EXPECT_EQ(robot.chassis.wheel_count, 0);
    EXPECT_FALSE(robot.chassis.gyro);
  }
}

TEST(Robot, a_velocity_has_its_correction) {
  const Robot robot = parse_robot(
      "[velocity]\nforward_scale = 1.02\nyaw_per_forward_rad_m = -0.03\nyaw_bias_rad_s = 0.004\n", "r");
  EXPECT_EQ(
      robot.chassis.velocity,
      (VelocityCorrection{
          .forward_scale = 1.02, .yaw_scale = 1.0, .yaw_per_forward_rad_m = -0.03, .yaw_bias_rad_s = 0.004}));
  EXPECT_EQ(to_toml(Robot{}).find("[velocity]"), std::string::npos);
}

TEST(Robot, lines_may_end_as_on_windows) {
  const Robot robot = parse_robot("[[wheel]]\r\nname = 'l'\r\ndiameter_m = 1\r\ndirection_deg = 30\r\n", "r");
  EXPECT_EQ(robot.chassis.wheels()[0].direction_rad, radians(30));
}

TEST(Robot, angles_are_read_with_all_their_digits_wherever_they_stand) {
  // An inline table, after letters of several bytes: columns are counted in characters.
  const Robot robot = parse_robot(
      "name = 'x'\nwheel = [{name = 'h\u00e4\u00df', direction_deg = 68.7549354156988207541, diameter_m = "
      "1}]\n",
      "r");
  EXPECT_EQ(robot.chassis.wheels()[0].direction_rad, radians_of_text("68.7549354156988207541"));
  EXPECT_EQ(parse_robot("[[wheel]]\nname='l'\ndirection_deg = 0x1E\ndiameter_m=1", "r")
                .chassis.wheels()[0]
                .direction_rad,
            radians(30));
}

TEST(Robot, a_file_is_read_from_disk_and_named_in_errors) {
  const auto path = std::filesystem::path(testing::TempDir()) / "trundle_robot_test.toml";
  write_file(path, kKobuki);
  EXPECT_EQ(read_robot(path).name, "kobuki");
  write_file(path, "name = 1\n");
  try {
    read_robot(path);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith(path.string() + ":1: "));
  }
  std::filesystem::remove(path);
  EXPECT_THROW(read_robot(path), InputError);
}

TEST(Robot, those_of_the_documentation_can_be_copied) {
  const std::string page = read_file(std::filesystem::path(TRUNDLE_SOURCE_DIR) / "docs" / "robot.md");
  constexpr std::string_view kBegin = "```toml\n";
  std::vector<std::string> names;
  for (std::size_t at = page.find(kBegin); at != std::string::npos; at = page.find(kBegin, at + 1)) {
    const std::size_t begin = at + kBegin.size();
    const Robot robot = parse_robot(page.substr(begin, page.find("```", begin) - begin), "docs/robot.md");
    EXPECT_EQ(observability(rows_of(robot.chassis, true)).rank, 3) << robot.name;
    names.push_back(robot.name);
  }
  EXPECT_THAT(names, ElementsAre("differential drive", "skid-steer", "three omni wheels", "mecanum",
                                 "tricycle", "pods", "recorded velocities"));
}

TEST(Robot, every_key_is_documented) {
  const std::string page = read_file(std::filesystem::path(TRUNDLE_SOURCE_DIR) / "docs" / "robot.md");
  std::vector<std::string> names;
  add_names(kWheelPlace, names);
  add_names(kWheelRoller, names);
  add_names(kWheelSize, names);
  add_names(kSteering, names);
  add_names(kChassis, names);
  add_names(kGyro, names);
  add_names(kLandmarkSensor, names);
  add_names(kNoise, names);
  add_names(kParameter, names);
  add_names(kError, names);
  for (const std::string& name : names) EXPECT_THAT(page, testing::HasSubstr("`" + name + "`"));
}

// --- writing

TEST(Robot, is_written_as_a_person_would) {
  Robot robot = test::robot_of(differential_drive({.diameter_m = 0.15, .ticks_per_revolution = 2048}, 0.4));
  robot.wheel_names = {"left", "right"};
  robot.chassis.wheels()[1].direction_rad = radians(-90);
  EXPECT_EQ(to_toml(robot), R"(name = "test"

[[wheel]]
name = "left"
x_m = 0.0
y_m = 0.2
direction_deg = 0.0
kind = "fixed"
diameter_m = 0.15
ticks_per_revolution = 2048.0

[[wheel]]
name = "right"
x_m = 0.0
y_m = -0.2
direction_deg = -90.0
kind = "fixed"
diameter_m = 0.15
ticks_per_revolution = 2048.0

[noise]
wheel_per_sqrt_m = 0.01
lateral_per_sqrt_m = 0.001
)");
}

TEST(Robot, sections_are_written_in_the_order_of_the_documentation) {
  const std::string text = to_toml(parse_robot(kKobuki, "robot.toml"));
  std::size_t at = 0;
  for (const char* heading : {"name", "icr_x_m", "[[wheel]]", "[[wheel]]", "[wheels]", "[gyro]",
                              "[landmark_sensor]", "[noise]", "[reference_sensor]"}) {
    at = text.find(heading, at + 1);
    if (heading == std::string_view("name")) at = 0;
    ASSERT_NE(at, std::string::npos) << heading << '\n' << text;
  }
}

// --- [calibration]

/// Where the second is not observable, its covariance says how wrong it may be as given; without, nothing.
CalibrationRecord record_of(bool second_observable, bool second_uncertain = true) {
  CalibrationRecord record;
  record.parameters = {{"w0.diameter", "m", 0.151, 0.15, 1e-4, 2e-4, true},
                       {"track", "m", 0.41, 0.4, 1e-3, std::nullopt, second_observable}};
  record.covariance = second_uncertain ? Eigen::MatrixXd{{5e-8, 1e-8}, {1e-8, 1e-6}}
                                       : Eigen::MatrixXd{{5e-8, 0.0}, {0.0, 0.0}};
  record.errors = {{"position rms, held out", 0.12, 0.013, "m"}};
  record.provenance = {"trundle: 0.1.0"};
  return record;
}

TEST(Robot, a_calibration_is_read_as_it_was_written) {
  for (const bool second_observable : {true, false}) {
    Robot robot = test::robot_of(differential_drive(test::kSize, 0.4));
    robot.calibration = record_of(second_observable);
    EXPECT_TRUE(same(parse_robot(to_toml(robot), "robot.toml"), robot)) << to_toml(robot);
  }
}

TEST(Robot, of_a_parameter_that_stays_as_given_a_calibration_need_not_say_how_wrong_it_is) {
  Robot robot = test::robot_of(differential_drive(test::kSize, 0.4));
  robot.calibration = record_of(false, false);
  EXPECT_EQ(robot.calibration->uncertain(), std::vector<Eigen::Index>{0});
  const std::string text = to_toml(robot);
  EXPECT_NE(text.find("covariance_of = [\n  \"w0.diameter\",\n]"), std::string::npos) << text;
  EXPECT_TRUE(same(parse_robot(text, "robot.toml"), robot)) << text;
}

TEST(Robot, a_parameter_the_runs_say_nothing_about_may_have_an_infinite_sigma) {
  Robot robot = test::robot_of(differential_drive(test::kSize, 0.4));
  robot.calibration = record_of(false);
  robot.calibration->parameters[1].sigma_within = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(same(parse_robot(to_toml(robot), "robot.toml"), robot));
}

TEST(Robot, a_calibration_that_could_tell_nothing_has_no_covariance) {
  Robot robot = test::robot_of(differential_drive(test::kSize, 0.4));
  robot.calibration.emplace().parameters = {{"track", "m", 0.4, 0.4, 1.0, std::nullopt, false}};
  EXPECT_TRUE(same(parse_robot(to_toml(robot), "robot.toml"), robot));
}

TEST(Robot, a_covariance_of_perfectly_correlated_parameters_is_read) {
  Robot robot = test::robot_of(differential_drive(test::kSize, 0.4));
  robot.calibration = record_of(true);
  robot.calibration->covariance = Eigen::MatrixXd{{1e-8, -1e-7}, {-1e-7, 1e-6}};
  EXPECT_TRUE(same(parse_robot(to_toml(robot), "robot.toml"), robot));
  robot.calibration->covariance.setZero();
  EXPECT_TRUE(same(parse_robot(to_toml(robot), "robot.toml"), robot));
}

}  // namespace
}  // namespace trundle::chassis
