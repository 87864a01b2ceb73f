// Angles of steered wheels that are read in another unit, or the wrong way round.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "trundle/inspection/findings.hpp"
#include "trundle/simulation/scenario.hpp"

namespace trundle::inspection {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// With a gyro where it is to show the turns.
Robot robot_of(std::string_view kind, bool has_gyro) {
  const WheelSize size{.diameter_m = 0.2, .ticks_per_revolution = 2000.0};
  const SteeringSensor steering{.sigma_rad = 0.005, .time_offset_s = -0.025};
  Robot robot;
  robot.name = kind;
  robot.chassis =
      kind == "tricycle" ? tricycle(size, 0.6, steering) : ackermann(size, 0.4, 0.6, 0.0, steering);
  for (std::size_t i = 0; i < robot.chassis.wheels().size(); ++i)
    robot.wheel_names.push_back(fmt::format("w{}", i));
  for (int i = 0; i < robot.chassis.passive_count; ++i) robot.passive_names.push_back(fmt::format("p{}", i));
  if (has_gyro) robot.chassis.gyro = Gyro{};
  return robot;
}

/// Straight on, curves both ways, and back.
Recording drive(const Robot& robot, bool backwards = true) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot;
  for (const double sense : {1.0, -1.0})
    for (const auto& [length_m, radius_m] :
         {std::pair{3.0, 1e6}, {9.0, 1.5}, {3.0, 4.5}, {-2.0, 1e6}, {-3.0, -3.0}})
      if (length_m > 0.0 || backwards)
        scenario.path.push_back({{length_m, 0.0, sense * length_m / radius_m}, std::abs(length_m) / 0.8});
  scenario.steering = Steering::truth;
  scenario.reference.rate_hz = 10.0;
  return simulate(scenario).recording;
}

/// What is wrong by the wheels' readings, in words.
std::vector<std::string> faults_of(const Recording& recording, const Robot& robot) {
  std::vector<std::string> words;
  for (const Finding& problem : find_in(recording, &robot).problems)
    if (problem.severity == Severity::warning) words.push_back(describe(problem));
  return words;
}

enum class Outside { none, positions, headings };

Recording with_outside(Recording recording, Outside outside) {
  if (outside == Outside::none) recording.reference = {};
  if (outside == Outside::positions)
    std::ranges::fill(recording.reference.heading_rad, recording::kNotMeasured);
  return recording;
}

void multiply_angles(double factor, Recording& recording) {
  for (WheelSeries& steering : recording.wheels.steering)
    for (double& angle : steering.value) angle *= factor;
}

/// Whatever else is measured.
TEST(SteeringUnit, degrees_that_were_taken_for_radians_are_named) {
  for (const char* kind : {"tricycle", "car"})
    for (const bool has_gyro : {false, true})
      for (const Outside outside : {Outside::none, Outside::positions, Outside::headings}) {
        const Robot robot = robot_of(kind, has_gyro);
        Recording recording = with_outside(drive(robot), outside);
        EXPECT_THAT(faults_of(recording, robot), Not(Contains(HasSubstr("steering")))) << kind << has_gyro;
        multiply_angles(180.0 / kPi, recording);
        EXPECT_THAT(faults_of(recording, robot), ElementsAre(HasSubstr("unit = \"deg\"")))
            << kind << has_gyro << static_cast<int>(outside);
      }
}

TEST(SteeringUnit, radians_that_were_taken_for_degrees_are_named) {
  const Robot robot = robot_of("tricycle", true);
  Recording recording = drive(robot);
  multiply_angles(kPi / 180.0, recording);
  EXPECT_THAT(faults_of(recording, robot), ElementsAre(HasSubstr("leave out unit = \"deg\"")));
}

/// With fewer counts to a revolution than there are the wheel turns round and round.
TEST(SteeringUnit, counts_of_which_a_revolution_has_more_are_named) {
  Robot robot = robot_of("car", true);
  Recording recording = drive(robot, false);
  SteeringSensor& sensor = *robot.chassis.all_wheels()[2].steering;
  sensor.scale = 0.25;
  sensor.ticks_per_revolution = 4096.0;
  for (WheelSeries& steering : recording.wheels.steering) {
    steering.unit = WheelUnit::ticks;
    for (double& angle : steering.value) angle = std::round(4.0 * angle / (2.0 * kPi) * 4096.0);
  }
  EXPECT_THAT(faults_of(recording, robot), IsEmpty());
  sensor.ticks_per_revolution /= 20.0;
  EXPECT_THAT(faults_of(recording, robot), ElementsAre(HasSubstr("steering_ticks_per_revolution")));
}

/// Straight on, on the spot, and in curves.
Recording drive_with_turns_on_the_spot(const Robot& robot) {
  Scenario scenario;
  scenario.nominal = scenario.truth = robot;
  for (const double sense : {1.0, -1.0})
    for (const auto& [length_m, turn_rad] : {std::pair{3.0, 0.0}, {0.0, 3.0}, {3.0, 2.0}})
      scenario.path.push_back({{length_m, 0.0, sense * turn_rad}, 4.0});
  scenario.steering = Steering::truth;
  return simulate(scenario).recording;
}

/// By either the turns are some tens of times too far.
TEST(SteeringUnit, is_not_blamed_for_a_diameter_in_inches) {
  const Robot truth = robot_of("tricycle", true);
  const Recording recording = drive_with_turns_on_the_spot(truth);
  Robot robot = truth;
  for (Wheel& wheel : robot.chassis.wheels()) wheel.diameter_m /= 0.0254;
  EXPECT_THAT(faults_of(recording, robot),
              ElementsAre(HasSubstr("x_m and steering_scale of steered wheels")));
}

/// Where a steering has its zero is nothing of its unit.
TEST(SteeringUnit, of_a_steering_whose_zero_is_elsewhere_is_left_alone) {
  const Robot robot = robot_of("tricycle", false);
  Recording recording = with_outside(drive(robot), Outside::none);
  for (WheelSeries& steering : recording.wheels.steering)
    for (double& angle : steering.value) angle = wrap_angle(angle + 3.0);
  EXPECT_THAT(faults_of(recording, robot), IsEmpty());
}

/// By the wheels that are not steered, where these turn the robot as it turns.
TEST(SteeringDirection, that_is_far_off_is_named_with_the_zero_to_write) {
  const auto is_of_direction = testing::Field(&Finding::code, FindingCode::steering_direction);
  for (const bool has_gyro : {false, true})
    for (const double off_deg : {-80.0, -45.0, 0.0, 15.0, 45.0, 90.0}) {
      Robot robot = robot_of("car", has_gyro);
      const Recording recording = drive(robot);
      robot.chassis.all_wheels()[2].steering->zero_rad = radians(off_deg);
      const std::vector<Finding> problems = find_in(recording, &robot).problems;
      if (std::abs(off_deg) < 20.0) {
        EXPECT_THAT(problems, Not(Contains(is_of_direction))) << off_deg;
        continue;
      }
      ASSERT_THAT(problems, ElementsAre(is_of_direction)) << off_deg;
      const double zero_rad = radians(std::get<recording::payload::Range>(problems[0].payload).high);
      EXPECT_NEAR(std::sin(zero_rad), 0.0, 0.02) << "half a turn is the same: " << off_deg;
    }
}

/// Readings of a sensor before a gear do not begin again after a turn.
TEST(SteeringDirection, of_a_geared_sensor_is_named_with_a_zero_that_it_can_read) {
  Robot robot = robot_of("car", true);
  Recording recording = drive(robot);
  SteeringSensor& sensor = *robot.chassis.all_wheels()[2].steering;
  sensor.scale = 0.2;
  sensor.zero_rad = radians(300.0);
  for (WheelSeries& steering : recording.wheels.steering)
    for (double& angle : steering.value) angle = angle / sensor.scale + sensor.zero_rad;
  EXPECT_THAT(faults_of(recording, robot), Not(Contains(HasSubstr("steering_zero_deg"))));
  sensor.zero_rad = radians(60.0);
  EXPECT_THAT(faults_of(recording, robot), Contains(HasSubstr("write steering_zero_deg = 30")));
}

/// Without a reading nothing says where a wheel points.
TEST(SteeringDirection, is_not_told_of_angles_that_are_not_there) {
  Robot robot = robot_of("car", true);
  Recording recording = drive(robot);
  for (WheelSeries& steering : recording.wheels.steering)
    std::ranges::fill(steering.value, recording::kNotMeasured);
  robot.chassis.all_wheels()[2].steering->zero_rad = radians(60.0);
  EXPECT_THAT(faults_of(recording, robot), Not(Contains(HasSubstr("steering_zero_deg"))));
}

/// With a dead encoder a car seems to turn all the while.
TEST(SteeringDirection, is_not_blamed_for_wheels_that_do_not_turn_the_robot_rightly) {
  const Robot robot = robot_of("car", true);
  Recording recording = drive(robot);
  std::ranges::fill(recording.wheels.series[0].value, 0.0);
  EXPECT_THAT(faults_of(recording, robot), Not(Contains(HasSubstr("steering_zero_deg"))));
}

TEST(SteeringSense, that_is_reversed_is_named) {
  for (const char* kind : {"tricycle", "car"})
    for (const Outside outside : {Outside::positions, Outside::headings}) {
      const Robot robot = robot_of(kind, false);
      Recording recording = with_outside(drive(robot), outside);
      multiply_angles(-1.0, recording);
      EXPECT_THAT(faults_of(recording, robot), ElementsAre(HasSubstr("steering_scale")))
          << kind << static_cast<int>(outside);
    }
}

TEST(SteeringSense, of_a_wheel_that_counts_backwards_is_right) {
  const Robot robot = robot_of("tricycle", false);
  Recording recording = drive(robot);
  for (double& angle : recording.wheels.series[0].value) angle *= -1.0;
  EXPECT_THAT(faults_of(recording, robot), ElementsAre(HasSubstr("counts backwards")));
}

}  // namespace
}  // namespace trundle::inspection
