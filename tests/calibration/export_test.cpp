#include "trundle/calibration/export.hpp"

#include <cctype>
#include <cmath>
#include <map>
#include <sstream>
#include <string>

#include <gmock/gmock.h>

#include "trundle/chassis/rows.hpp"
#include "trundle/io/error.hpp"

namespace trundle::calibration {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// The numbers of "key: 1", "KEY,1" and "public double key = 1; // ..." lines.
std::map<std::string, double> numbers_in(const std::string& text) {
  std::map<std::string, double> numbers;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t split = line.find_first_of(":,=");
    if (split == std::string::npos || line.starts_with("#") || line.starts_with("//")) continue;
    std::string key = line.substr(0, split);
    key.erase(key.find_last_not_of(' ') + 1);
    key.erase(0, key.find_last_of(' ') + 1);
    try {
      numbers[key] = std::stod(line.substr(split + 1));
    } catch (const std::invalid_argument&) {
    }
  }
  return numbers;
}

Robot differential(double left_m, double right_m, double track_m) {
  Robot robot;
  robot.name = "cart";
  robot.chassis = differential_drive({.diameter_m = 0.07, .ticks_per_revolution = 2578.33}, track_m);
  robot.chassis.wheel_storage[0].diameter_m = left_m;
  robot.chassis.wheel_storage[1].diameter_m = right_m;
  robot.wheel_names = {"left", "right"};
  return robot;
}

Robot pods(double direction_of_perpendicular) {
  const std::array<Pod, 3> places = {
      {{0.01, 0.15, 0.0}, {0.02, -0.16, 0.0}, {-0.12, 0.03, direction_of_perpendicular}}};
  Robot robot;
  robot.name = "pods";
  robot.chassis = dead_wheels({.diameter_m = 0.048, .ticks_per_revolution = 2000}, places, {});
  robot.wheel_names = {"par_left", "par_right", "perp"};
  return robot;
}

TEST(Export, NamesItsFormats) {
  EXPECT_THAT(export_formats(),
              ElementsAre("ros2_control", "road_runner", "ardupilot", "wpilib", "robot_localization"));
  EXPECT_EQ(export_suffix("ros2_control"), "ros2_control.yaml");
}

TEST(Export, Ros2ControlMultipliesToTheCalibratedRobot) {
  const std::string text =
      export_robot("ros2_control", differential(0.07, 0.07, 0.23), differential(0.0702, 0.0699, 0.2315));
  const auto n = numbers_in(text);
  EXPECT_NEAR(n.at("wheel_separation"), 0.23, 1e-9);
  EXPECT_NEAR(n.at("wheel_separation") * n.at("wheel_separation_multiplier"), 0.2315, 1e-9);
  EXPECT_NEAR(n.at("wheel_radius") * n.at("left_wheel_radius_multiplier"), 0.0351, 1e-9);
  EXPECT_NEAR(n.at("wheel_radius") * n.at("right_wheel_radius_multiplier"), 0.03495, 1e-9);
  EXPECT_THAT(text,
              HasSubstr("diff_drive_controller:\n  ros__parameters:\n    left_wheel_names: [\"left\"]\n"));
}

TEST(Export, SaysThatNoStackHasAWordForTyresThatGrow) {
  Robot robot = differential(0.0701, 0.0699, 0.231);
  EXPECT_THAT(export_robot("ros2_control", robot, robot), testing::Not(HasSubstr("slow wheels")));
  robot.chassis.tyre_growth_s2_m2 = 0.0125;
  EXPECT_THAT(export_robot("ros2_control", robot, robot), HasSubstr("share 0.0125 v^2 further"));
}

TEST(Export, Ros2ControlKnowsSkidSteerByItsSides) {
  Robot robot = differential(0.2, 0.2, 0.6);
  robot.chassis = skid_steer({.diameter_m = 0.2}, 0.6, 0.4);
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  EXPECT_THAT(export_robot("ros2_control", robot, robot), HasSubstr("right_wheel_names: [\"fr\", \"rr\"]"));
}

Robot steered(const Chassis& chassis) {
  Robot robot;
  robot.name = "steered";
  robot.chassis = chassis;
  for (int i = 0; i < chassis.wheel_count; ++i) robot.wheel_names.push_back("w" + std::to_string(i));
  for (int i = 0; i < chassis.passive_count; ++i) robot.passive_names.push_back("p" + std::to_string(i));
  return robot;
}

TEST(Export, Ros2ControlKnowsTricycles) {
  Robot robot = steered(tricycle({.diameter_m = 0.2}, 1.2, {.zero_rad = 0.03, .scale = -1.01}));
  robot.chassis.all_wheels()[1].x_m = 0.1;  // the axle
  const std::string text = export_robot("ros2_control", robot, robot);
  EXPECT_NEAR(numbers_in(text).at("wheelbase"), 1.1, 1e-9);
  EXPECT_NEAR(numbers_in(text).at("wheel_radius"), 0.1, 1e-9);
  EXPECT_THAT(text, HasSubstr("tricycle_controller:\n  ros__parameters:\n    traction_joint_name: \"w0\""));
  EXPECT_THAT(text, HasSubstr("position = -1.01 * (reading - 0.03) rad"));
}

TEST(Export, Ros2ControlKnowsCarsByTheirSteeredWheels) {
  Robot car = steered(ackermann({.diameter_m = 0.6}, 1.5, 2.6, 1.4));
  car.chassis.wheels()[0].diameter_m = 0.62;
  const std::string text = export_robot("ros2_control", car, car);
  const auto n = numbers_in(text);
  EXPECT_NEAR(n.at("wheelbase"), 2.6, 1e-9);
  EXPECT_NEAR(n.at("traction_track_width"), 1.5, 1e-9);
  EXPECT_NEAR(n.at("steering_track_width"), 1.4, 1e-9);
  EXPECT_NEAR(n.at("traction_wheels_radius"), 0.305, 1e-9);
  EXPECT_THAT(text, HasSubstr("\nackermann_steering_controller:\n"));
  EXPECT_THAT(text, HasSubstr("steering_joints_names: [\"p0\", \"p1\"]"));
  const Robot one = steered(ackermann({.diameter_m = 0.6}, 1.5, 2.6));
  EXPECT_THAT(export_robot("ros2_control", one, one), HasSubstr("\ntricycle_steering_controller:\n"));
}

TEST(Export, StacksWithoutWordsForASteeredRobotRefuse) {
  const Robot swerve_robot = steered(swerve({.diameter_m = 0.1, .ticks_per_revolution = 1000}, 0.5, 0.6));
  const Robot car = steered(ackermann({.diameter_m = 0.6, .ticks_per_revolution = 1000}, 1.5, 2.6));
  EXPECT_THROW((void)export_robot("ros2_control", swerve_robot, swerve_robot), CannotAnswer);
  EXPECT_THROW((void)export_robot("wpilib", car, car), CannotAnswer);
  for (const auto* format : {"road_runner", "ardupilot"})
    for (const Robot* robot : {&swerve_robot, &car})
      EXPECT_THROW((void)export_robot(format, *robot, *robot), CannotAnswer) << format;
}

// WPILib's module angle is from ahead: what the reading is offset by contains the direction at zero.
TEST(Export, WpilibHasAModuleForEachWheel) {
  Robot robot = steered(swerve({.diameter_m = 0.1}, 0.5, 0.6, {.zero_rad = 0.7}));
  robot.chassis.wheels()[1].direction_rad = 0.2;
  robot.wheel_names = {"front-left", "fr", "rl", "rr"};
  const std::string text = export_robot("wpilib", robot, robot);
  EXPECT_THAT(text, HasSubstr("front_leftLocation = new Translation2d(0.3, 0.25);"));
  EXPECT_THAT(text, HasSubstr("front_leftOffset = Rotation2d.fromRadians(0.7); // angle = 1 * (reading"));
  EXPECT_THAT(text, HasSubstr("frOffset = Rotation2d.fromRadians(0.5);"));
  EXPECT_THAT(text,
              HasSubstr("new SwerveDriveKinematics(front_leftLocation, frLocation, rlLocation, rrLocation)"));
}

/// Of two wheels, each with 1 cm over a metre: the mean of both ahead, and their difference over the track.
TEST(Export, RobotLocalizationHasTheNoiseOfWheelsAsVelocities) {
  Robot robot = differential(0.07, 0.07, 0.5);
  robot.chassis.noise.wheel_per_sqrt_m = 0.01;
  robot.chassis.noise.lateral_per_sqrt_m = 0.002;
  robot.chassis.gyro = Gyro{.bias_rad_s = 0.01, .scale = 1.02, .noise_rad_s_sqrt_hz = 0.003};
  const std::string text = export_robot("robot_localization", robot, robot);
  const std::size_t at = text.find("twist_covariance_diagonal: [");
  ASSERT_NE(at, std::string::npos);
  std::istringstream numbers(text.substr(at + 28));
  std::vector<double> diagonal(6);
  for (double& number : diagonal) (numbers >> number).ignore();
  const double way_per_square_interval = 0.5 * 50.0;  // (v/f) / (1/f)²
  EXPECT_NEAR(diagonal[0], 0.5e-4 * way_per_square_interval, 1e-7);
  EXPECT_NEAR(diagonal[1], 0.04e-4 * way_per_square_interval, 1e-8);
  EXPECT_NEAR(diagonal[5], 2e-4 / 0.25 * way_per_square_interval, 1e-6);
  EXPECT_THAT(text, HasSubstr("at 100 messages a second: 0.0009 rad2/s2"));
  // Forward and yaw rate are the 7th and the 12th state.
  EXPECT_THAT(text, HasSubstr("odom0_config: [false, false, false, false, false, false, true, true, false, "
                              "false, false, true, false, false, false]"));
}

/// ROS 2 takes 0 and 1 for integers, and refuses them where it wants doubles.
TEST(Export, NumbersForRos2HaveAPointOrAnExponent) {
  Robot robot = differential(1.0, 1.0, 2.0);
  robot.chassis.wheel_storage[0].diameter_m = robot.chassis.wheel_storage[1].diameter_m = 2.0;
  for (const auto* format : {"ros2_control", "robot_localization"}) {
    std::istringstream lines(export_robot(format, robot, robot));
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("#") || line.find("    #") == 0) continue;
      std::istringstream words(line.substr(line.find(':') == std::string::npos ? 0 : line.find(':') + 1));
      for (std::string word; words >> word;) {
        const bool is_number = std::isdigit(static_cast<unsigned char>(word[word[0] == '[' ? 1 : 0])) != 0;
        EXPECT_TRUE(!is_number || word.find_first_of(".e") != std::string::npos) << line;
      }
    }
  }
  EXPECT_THAT(export_robot("ros2_control", robot, robot), HasSubstr("wheel_separation: 2.0\n"));
}

TEST(Export, RobotLocalizationNeedsWheelsThatSeeTheMotion) {
  Robot robot = pods(0.5 * kPi);
  robot.chassis.wheel_count = 2;
  robot.wheel_names.resize(2);
  EXPECT_THROW((void)export_robot("robot_localization", robot, robot), CannotAnswer);
}

TEST(Export, ArduPilotHasYToTheRightAndWholeCounts) {
  const auto n =
      numbers_in(export_robot("ardupilot", differential(0.07, 0.07, 0.23), differential(0.07, 0.0699, 0.24)));
  EXPECT_EQ(n.at("WENC_CPR"), 2578.0);
  EXPECT_NEAR(n.at("WENC_POS_Y"), -0.12, 1e-9);
  EXPECT_NEAR(n.at("WENC2_POS_Y"), 0.12, 1e-9);
  // Metres per count are kept although the counts are rounded.
  EXPECT_NEAR(2.0 * kPi * n.at("WENC2_RADIUS") / n.at("WENC2_CPR"), kPi * 0.0699 / 2578.33, 1e-11);
}

TEST(Export, ArduPilotSaysWhichEncoderCountsBackwards) {
  Robot robot = differential(0.07, 0.07, 0.23);
  robot.chassis.wheel_storage[1].ticks_per_revolution = -2000;
  const std::string text = export_robot("ardupilot", robot, robot);
  EXPECT_THAT(text, HasSubstr("# 'right' counts backwards"));
  EXPECT_EQ(numbers_in(text).at("WENC2_CPR"), 2000.0);
}

/// What Road Runner's three-wheel localizer makes of readings: forward, left, turn.
Vector3 localized(const std::map<std::string, double>& n, double par0, double par1, double perp) {
  const double span = n.at("par0YTicks") - n.at("par1YTicks");
  return {n.at("inPerTick") * (n.at("par0YTicks") * par1 - n.at("par1YTicks") * par0) / span,
          n.at("inPerTick") * (n.at("perpXTicks") / span * (par1 - par0) + perp), (par0 - par1) / span};
}

TEST(Export, RoadRunnersLocalizerFindsTheTwistFromThePods) {
  for (const double direction : {0.5 * kPi, -0.5 * kPi}) {
    const Robot robot = pods(direction);
    const std::string text = export_robot("road_runner", robot, robot);
    const Vector3 twist(0.5, -0.2, 0.3);
    const Rows rows = rows_of(robot.chassis, false);
    const double metres_per_tick = kPi * 0.048 / 2000;
    RowVector ticks = rows.H * twist / metres_per_tick;
    if (direction < 0.0) ticks[2] = -ticks[2];  // set to REVERSE, as the text asks
    EXPECT_EQ(direction < 0.0, text.find("'perp': counts backwards") != std::string::npos);
    const Vector3 found = localized(numbers_in(text), ticks[0], ticks[1], ticks[2]);
    EXPECT_NEAR(found.x() * 0.0254, twist.x(), 1e-7);
    EXPECT_NEAR(found.y() * 0.0254, twist.y(), 1e-7);
    EXPECT_NEAR(found.z(), twist.z(), 1e-7);
  }
}

TEST(Export, RoadRunnerWithTwoPodsUsesOtherNames) {
  Robot robot = pods(0.5 * kPi);
  robot.chassis.wheel_storage[1] = robot.chassis.wheel_storage[2];
  robot.chassis.wheel_count = 2;
  robot.wheel_names = {"par", "perp"};
  const auto n = numbers_in(export_robot("road_runner", robot, robot));
  EXPECT_NEAR(n.at("parYTicks") * n.at("inPerTick") * 0.0254, -0.15, 1e-9);
  EXPECT_NEAR(n.at("perpXTicks") * n.at("inPerTick") * 0.0254, -0.12, 1e-9);
}

TEST(Export, RoadRunnerSaysWhatOneTickLengthCannot) {
  Robot robot = pods(0.5 * kPi);
  robot.chassis.wheel_storage[0].diameter_m *= 1.01;
  EXPECT_THAT(export_robot("road_runner", robot, robot), HasSubstr("differ from it by up to 0.66 %"));
}

TEST(Export, RoadRunnersMecanumKinematicsFindTheTwist) {
  Robot robot;
  robot.chassis = mecanum({.diameter_m = 0.1, .ticks_per_revolution = 537.7}, 0.4, 0.3);
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  const auto n = numbers_in(export_robot("road_runner", robot, robot));
  const Vector3 twist(0.5, -0.2, 0.3);
  const RowVector inches = rows_of(robot.chassis, false).H * twist / 0.0254;
  const double lateral_multiplier = n.at("inPerTick") / n.at("lateralInPerTick");
  EXPECT_NEAR(0.25 * (-inches[0] + inches[1] + inches[2] - inches[3]) / lateral_multiplier * 0.0254,
              twist.y(), 1e-9);
  EXPECT_NEAR(
      0.25 * (-inches[0] + inches[1] - inches[2] + inches[3]) / (n.at("trackWidthTicks") * n.at("inPerTick")),
      twist.z(), 1e-8);
}

TEST(Export, RoadRunnersTankHasTheWholeTrack) {
  const auto n =
      numbers_in(export_robot("road_runner", differential(0.07, 0.07, 0.23), differential(0.07, 0.07, 0.24)));
  EXPECT_NEAR(n.at("trackWidthTicks") * n.at("inPerTick") * 0.0254, 0.24, 1e-9);
}

TEST(Export, StacksWithoutWordsSaySo) {
  const Robot three_pods = pods(0.5 * kPi);
  EXPECT_THROW(export_robot("ros2_control", three_pods, three_pods), CannotAnswer);
  EXPECT_THROW(export_robot("ardupilot", three_pods, three_pods), CannotAnswer);
  const Robot slanted = pods(0.25 * kPi);
  EXPECT_THROW(export_robot("road_runner", slanted, slanted), CannotAnswer);
  Robot counts_nothing = differential(0.07, 0.07, 0.23);
  counts_nothing.chassis.wheel_storage[0].ticks_per_revolution = 0.0;
  EXPECT_THROW(export_robot("road_runner", counts_nothing, counts_nothing), CannotAnswer);
  EXPECT_THROW(export_robot("ardupilot", counts_nothing, counts_nothing), CannotAnswer);
  Robot omni = three_pods;
  omni.chassis = omni3({.diameter_m = 0.1, .ticks_per_revolution = 100}, 0.2);
  EXPECT_THROW(export_robot("road_runner", omni, omni), CannotAnswer);
}

}  // namespace
}  // namespace trundle::calibration
