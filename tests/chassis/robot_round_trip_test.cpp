#include <limits>

#include <gtest/gtest.h>

#include "trundle/chassis/parameter.hpp"

#include "chassis/robots.hpp"
#include "chassis/same_robot.hpp"
#include "property.hpp"

namespace trundle::chassis {
namespace {

using namespace robot_file;
using test::same;
using test::uniform;

/// Any number the key takes: angles within a turn, everything else of any size from 1e-9 to 10.
double any_value(const Range& range, bool angle) {
  double value = angle ? *uniform(-1.5, 1.5) : *uniform(-1, 1) * std::pow(10.0, *uniform(-9, 1));
  if (!range.holds(value)) value = -value;
  return value;
}

template <class T, std::size_t n>
void randomise(const std::array<NumberKey<T>, n>& keys, T& section) {
  for (const NumberKey<T>& key : keys) key.in(section) = any_value(key.range, is_degrees(key.name));
}

Wheel any_wheel() {
  Wheel wheel;
  wheel.kind = kWheelKinds[*rc::gen::inRange<std::size_t>(0, kWheelKinds.size())].first;
  randomise(kWheelPlace, wheel);
  randomise(kWheelSize, wheel);
  if (wheel.kind == WheelKind::mecanum) randomise(kWheelRoller, wheel);
  wheel.tick_bits = *rc::gen::inRange(0, 65);
  if (wheel.kind == WheelKind::fixed && *rc::gen::arbitrary<bool>())
    randomise(robot_file::kSteering, wheel.steering.emplace());
  return wheel;
}

Wheel any_passive_wheel() {
  Wheel wheel;
  randomise(kWheelPlace, wheel);
  if (*rc::gen::arbitrary<bool>()) randomise(robot_file::kSteering, wheel.steering.emplace());
  return wheel;
}

CalibrationRecord any_record(const Robot& robot) {
  CalibrationRecord record;
  for (const Parameter& parameter : parameters_of(robot)) {
    CalibratedParameter calibrated;
    calibrated.name = name_of(parameter, robot);
    calibrated.unit = unit_of(parameter);
    randomise(kParameter, calibrated);
    calibrated.sigma_within = *uniform(0, 1);
    calibrated.observable = *rc::gen::arbitrary<bool>();
    if (*rc::gen::arbitrary<bool>()) calibrated.sigma_between = *uniform(0, 1);
    record.parameters.push_back(calibrated);
  }
  const auto n = std::ssize(record.parameters);
  Eigen::MatrixXd A(n, n);
  for (double& a : A.reshaped()) a = *uniform(-1e-3, 1e-3);
  for (Eigen::Index i = 0; i < n; ++i)  // of what stays as given some may be wrong, and some is exact
    if (!record.parameters[static_cast<std::size_t>(i)].observable && *rc::gen::arbitrary<bool>())
      A.row(i).setZero();
  record.covariance = A * A.transpose();
  if (record.uncertain().empty()) record.covariance.resize(0, 0);
  ErrorBeforeAfter error{.what = "position rms over \"free\"\\1\n\u00e9\t", .unit = "m"};
  randomise(kError, error);
  record.errors = {error, error};
  record.provenance = {"trundle: 0.1.0", "input: a b.csv, sha256 00"};
  return record;
}

Robot any_robot() {
  Robot robot;
  robot.name = *rc::gen::element<std::string>("", "kobuki", "a \"quoted\" \\ name\n\u00fc\x7f");
  randomise(kChassis, robot.chassis);
  robot.chassis.scrub = *uniform(-0.8, 0.8);
  robot.chassis.tyre_growth_s2_m2 = *uniform(-1.0, 1.0);
  randomise(kAllWheels, robot.chassis);
  randomise(kNoise, robot.chassis.noise);
  randomise(kReferenceSensor, robot);
  randomise(kMarker, robot);
  const int wheels = *rc::gen::inRange(0, kMaxWheels + 1);
  for (int i = 0; i < wheels; ++i) {
    robot.chassis.add(any_wheel());
    robot.wheel_names.push_back(fmt::format("wheel-{}", i));
  }
  const int passive = wheels == 0 ? 0 : *rc::gen::inRange(0, kMaxWheels + 1 - wheels);
  for (int i = 0; i < passive; ++i) {
    robot.chassis.add_passive(any_passive_wheel());
    robot.passive_names.push_back(fmt::format("passive-{}", i));
  }
  if (*rc::gen::arbitrary<bool>()) randomise(kGyro, robot.chassis.gyro.emplace());
  if (*rc::gen::arbitrary<bool>()) {
    randomise(kLandmarkSensor, robot.landmark_sensor.emplace());
    robot.landmark_sensor->range_scale = *uniform(0.01, 100.0);
    robot.landmark_sensor->depth_share = *uniform(-1.0, 2.0);
  }
  if (*rc::gen::arbitrary<bool>()) robot.calibration = any_record(robot);
  return robot;
}

RC_GTEST_PROP(Robot, what_is_written_is_read_to_the_last_bit, ()) {
  const Robot robot = any_robot();
  const std::string text = to_toml(robot);
  const Robot again = parse_robot(text, "robot.toml");
  RC_ASSERT(same(robot, again));
  RC_ASSERT(to_toml(again) == text);
}

TEST(Robot, common_robots_are_read_as_they_were_written) {
  for (const Chassis& chassis :
       {test::with_gyro(differential_drive(test::kSize, 0.4)), skid_steer(test::kSize, 0.6, 0.5),
        omni3(test::kSize, 0.2), mecanum(test::kSize, 0.3, 0.4), test::three_pods(), test::velocity_robot(),
        test::odd_chassis(), tricycle(test::kSize, 1.0), ackermann(test::kSize, 0.4, 0.6, 0.3),
        swerve(test::kSize, 0.4, 0.5), test::odd_steered_chassis()}) {
    const Robot robot = test::robot_of(chassis);
    EXPECT_TRUE(same(parse_robot(to_toml(robot), "robot.toml"), robot)) << to_toml(robot);
  }
}

TEST(Robot, doubles_at_their_limits_survive) {
  Robot robot = test::robot_of(differential_drive(test::kSize, 0.4));
  Wheel& wheel = robot.chassis.wheels()[0];
  wheel.x_m = std::numeric_limits<double>::denorm_min();
  wheel.y_m = -0.0;
  wheel.direction_rad = -0.0;
  wheel.ticks_per_revolution = -std::numeric_limits<double>::max();
  robot.chassis.wheels()[1].direction_rad = -std::nextafter(2 * kPi, 0.0);
  robot.chassis.wheels()[1].ticks_per_revolution = 1e22;
  EXPECT_TRUE(same(parse_robot(to_toml(robot), "robot.toml"), robot)) << to_toml(robot);
}

}  // namespace
}  // namespace trundle::chassis
