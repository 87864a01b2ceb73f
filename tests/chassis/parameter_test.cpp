#include "trundle/chassis/parameter.hpp"

#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/chassis/usual_parameters.hpp"

#include "chassis/robots.hpp"

namespace trundle::chassis {
namespace {

using test::kSize;
using test::robot_of;
using testing::ElementsAre;

std::vector<Robot> every_robot() {
  std::vector<Robot> robots;
  Chassis tricycle = differential_drive(kSize, 0.4);
  tricycle.add({.x_m = 0.3, .direction_rad = 0.1, .kind = WheelKind::skid, .diameter_m = 0.1});
  Chassis off_centre = differential_drive(kSize, 0.4);
  for (Wheel& wheel : off_centre.wheels()) wheel.y_m += 0.05;
  Chassis growing = skid_steer(kSize, 0.6, 0.5);
  growing.scrub = 0.1;
  growing.tyre_growth_s2_m2 = 0.03;
  for (const Chassis& chassis :
       {growing, test::with_gyro(differential_drive(kSize, 0.4)),
        test::with_gyro(skid_steer(kSize, 0.6, 0.5)), omni3(kSize, 0.2), mecanum(kSize, 0.3, 0.4),
        test::three_pods(), test::odd_chassis(), tricycle, off_centre,
        test::joined(differential_drive(kSize, 0.4), test::three_pods()), test::velocity_robot(),
        chassis::tricycle(kSize, 1.0, test::kSteering), ackermann(kSize, 0.4, 0.6, 0.3, test::kSteering),
        swerve(kSize, 0.4, 0.5, test::kSteering), test::odd_steered_chassis()})
    robots.push_back(robot_of(chassis));
  return robots;
}

std::vector<std::string> names_of(const Robot& robot) {
  std::vector<std::string> names;
  for (const Parameter& parameter : parameters_of(robot)) names.push_back(name_of(parameter, robot));
  return names;
}

template <class F>
auto central_difference(const Parameter& parameter, const Robot& robot, F f) {
  constexpr double h = 1e-6;
  Robot above = robot;
  Robot below = robot;
  set_value(parameter, value_of(parameter, robot) + h, above);
  set_value(parameter, value_of(parameter, robot) - h, below);
  return ((f(above) - f(below)) / (2 * h)).eval();
}

TEST(Parameter, a_differential_drive_has_these) {
  Robot robot = robot_of(differential_drive(kSize, 0.4));
  robot.wheel_names = {"left", "right"};
  EXPECT_THAT(names_of(robot), ElementsAre("left.diameter", "left.lever", "right.diameter", "right.lever",
                                           "track", "tyre_growth", "reference.x", "reference.y",
                                           "reference.heading", "reference.time_offset"));
}

TEST(Parameter, a_tricycle_has_these) {
  Robot robot = robot_of(tricycle(kSize, 1.0));
  robot.wheel_names = {"front"};
  robot.passive_names = {"rear"};
  EXPECT_THAT(names_of(robot), ElementsAre("front.diameter", "front.steering_zero", "front.steering_scale",
                                           "front.x", "front.y", "tyre_growth", "reference.x", "reference.y",
                                           "reference.heading", "reference.time_offset"));
}

TEST(Parameter, a_passive_wheel_that_is_steered_has_its_steering_and_its_place) {
  Robot robot = robot_of(ackermann(kSize, 0.4, 0.6));
  robot.wheel_names = {"left", "right"};
  robot.passive_names = {"front"};
  const auto names = names_of(robot);
  EXPECT_THAT(names, testing::IsSupersetOf({"left.diameter", "front.steering_zero", "front.steering_scale",
                                            "front.x", "front.y", "track"}));
  EXPECT_THAT(names, testing::Not(testing::Contains("front.diameter")));
}

TEST(Parameter, an_omni_robot_has_directions_and_no_track) {
  EXPECT_THAT(names_of(robot_of(omni3(kSize, 0.2))),
              ElementsAre("w0.diameter", "w0.direction", "w0.lever", "w1.diameter", "w1.direction",
                          "w1.lever", "w2.diameter", "w2.direction", "w2.lever", "tyre_growth", "reference.x",
                          "reference.y", "reference.heading", "reference.time_offset"));
}

TEST(Parameter, skid_wheels_have_a_centre_of_rotation_and_a_gyro_scale_and_bias) {
  const auto names = names_of(robot_of(test::with_gyro(skid_steer(kSize, 0.6, 0.5))));
  EXPECT_THAT(names, testing::IsSupersetOf({"track", "icr_x", "gyro.scale", "gyro.bias"}));
}

TEST(Parameter, a_velocity_has_scales_a_turn_with_travel_and_a_bias_and_wheels_have_none) {
  Chassis chassis = test::velocity_robot();
  chassis.gyro.reset();
  EXPECT_THAT(names_of(robot_of(chassis)),
              ElementsAre("velocity.forward_scale", "velocity.yaw_scale", "velocity.yaw_per_forward",
                          "velocity.yaw_bias", "reference.x", "reference.y", "reference.heading",
                          "reference.time_offset"));
  EXPECT_FALSE(parameter_named("velocity.yaw_bias", robot_of(differential_drive(kSize, 0.4))));
}

TEST(Parameter, names_are_unique_and_found_again) {
  for (const Robot& robot : every_robot()) {
    std::set<std::string> seen;
    for (const Parameter& parameter : parameters_of(robot)) {
      const std::string name = name_of(parameter, robot);
      EXPECT_TRUE(seen.insert(name).second) << name;
      EXPECT_EQ(parameter_named(name, robot), parameter) << name;
    }
    EXPECT_FALSE(parameter_named("w9.diameter", robot));
    EXPECT_FALSE(parameter_named("", robot));
  }
}

TEST(Parameter, what_a_robot_lacks_is_not_found) {
  const Robot robot = robot_of(omni3(kSize, 0.2));
  for (const char* name : {"track", "icr_x", "gyro.scale", "gyro.bias"})
    EXPECT_FALSE(parameter_named(name, robot));
}

TEST(Parameter, has_units_by_its_kind) {
  EXPECT_EQ(unit_of({ParameterKind::diameter, 0}), "m");
  EXPECT_EQ(unit_of({ParameterKind::lever, 0}), "m");
  EXPECT_EQ(unit_of({ParameterKind::direction, 0}), "rad");
  EXPECT_EQ(unit_of({ParameterKind::reference_heading}), "rad");
  EXPECT_EQ(unit_of({ParameterKind::gyro_scale}), "1");
  EXPECT_EQ(unit_of({ParameterKind::gyro_bias}), "rad/s");
  EXPECT_EQ(unit_of({ParameterKind::velocity_yaw_scale}), "1");
  EXPECT_EQ(unit_of({ParameterKind::velocity_yaw_per_forward}), "rad/m");
  EXPECT_EQ(unit_of({ParameterKind::velocity_yaw_bias}), "rad/s");
  EXPECT_EQ(unit_of({ParameterKind::time_offset}), "s");
  EXPECT_EQ(unit_of({ParameterKind::tyre_growth}), "s^2/m^2");
  EXPECT_EQ(unit_of({ParameterKind::steering_zero, 0}), "rad");
  EXPECT_EQ(unit_of({ParameterKind::steering_scale, 0}), "1");
  EXPECT_EQ(unit_of({ParameterKind::place_x, 0}), "m");
}

TEST(Parameter, what_is_set_is_the_value) {
  for (const Robot& robot : every_robot())
    for (const Parameter& parameter : parameters_of(robot)) {
      Robot changed = robot;
      const double value = value_of(parameter, robot) * 1.1 + 0.01;
      set_value(parameter, value, changed);
      EXPECT_NEAR(value_of(parameter, changed), value, 1e-15) << name_of(parameter, robot);
    }
}

TEST(Parameter, setting_one_leaves_those_of_other_wheels_alone) {
  for (const Robot& robot : every_robot())
    for (const Parameter& parameter : parameters_of(robot)) {
      if (parameter.kind == ParameterKind::track) continue;  // moves wheels, and so their levers
      Robot changed = robot;
      set_value(parameter, value_of(parameter, robot) * 1.1 + 0.01, changed);
      for (const Parameter& other : parameters_of(robot)) {
        // A lever, and a direction that keeps its lever, move the wheel, and the track is where the wheels
        // are.
        if (other == parameter || other.kind == ParameterKind::track) continue;
        EXPECT_NEAR(value_of(other, changed), value_of(other, robot), 1e-15)
            << name_of(parameter, robot) << " changed " << name_of(other, robot);
      }
    }
}

TEST(Parameter, track_is_the_distance_of_the_sides_and_keeps_their_middle) {
  Robot robot = robot_of(differential_drive(kSize, 0.4));
  for (Wheel& wheel : robot.chassis.wheels()) wheel.y_m += 0.05;
  const Parameter track{ParameterKind::track};
  EXPECT_DOUBLE_EQ(value_of(track, robot), 0.4);
  set_value(track, 0.5, robot);
  EXPECT_DOUBLE_EQ(robot.chassis.wheels()[0].y_m, 0.3);
  EXPECT_DOUBLE_EQ(robot.chassis.wheels()[1].y_m, -0.2);
}

// It counted as exact, and pods' levers came out wrong for it.
TEST(Parameter, track_beside_pods_is_that_of_the_driven_wheels) {
  const Parameter track{ParameterKind::track};
  for (const Chassis& chassis : {test::joined(differential_drive(kSize, 0.2), test::three_pods()),
                                 test::joined(test::three_pods(), differential_drive(kSize, 0.2))}) {
    Robot robot = robot_of(chassis);
    EXPECT_THAT(usual_parameters(robot), testing::Contains(track));
    EXPECT_DOUBLE_EQ(value_of(track, robot), 0.2);
    set_value(track, 0.5, robot);
    EXPECT_DOUBLE_EQ(value_of(track, robot), 0.5);
    for (std::size_t i = 0; i < robot.chassis.wheels().size(); ++i) {
      const Wheel& before = chassis.wheels()[i];
      EXPECT_DOUBLE_EQ(robot.chassis.wheels()[i].y_m,
                       before.kind == WheelKind::omni ? before.y_m : 2.5 * before.y_m);
    }
  }
}

TEST(Parameter, setting_what_is_there_changes_nothing_much) {
  for (const Robot& robot : every_robot())
    for (const Parameter& parameter : parameters_of(robot)) {
      Robot same = robot;
      set_value(parameter, value_of(parameter, robot), same);
      const RowMatrix H = rows_of(same.chassis, true).H;
      EXPECT_LT((H - rows_of(robot.chassis, true).H).norm(), 1e-15) << name_of(parameter, robot);
    }
}

TEST(Parameter, derivative_of_rows_agrees_with_numeric_differentiation) {
  for (const Robot& robot : every_robot()) {
    const Rows rows = rows_of(robot.chassis, true);
    for (const Parameter& parameter : parameters_of(robot)) {
      const RowMatrix numeric = central_difference(
          parameter, robot, [](const Robot& r) { return RowMatrix(rows_of(r.chassis, true).H); });
      const RowMatrix analytic = row_derivative(parameter, robot.chassis, rows);
      EXPECT_LT((analytic - numeric).norm(), 1e-8) << name_of(parameter, robot) << '\n'
                                                   << analytic << '\n'
                                                   << numeric;
    }
  }
}

TEST(Parameter, derivative_of_readings_agrees_with_numeric_differentiation) {
  for (const Robot& robot : every_robot()) {
    const Rows rows = rows_of(robot.chassis, true);
    const Increment increment = test::increment_of(robot.chassis, {0.5, 0.1, 0.3}, 0.2);
    for (const Parameter& parameter : parameters_of(robot)) {
      const RowVector numeric = central_difference(parameter, robot, [&](const Robot& r) {
        return RowVector(readings_of(r.chassis, rows_of(r.chassis, true), increment).z);
      });
      const RowVector analytic = reading_derivative(parameter, robot.chassis, rows, increment);
      EXPECT_LT((analytic - numeric).norm(), 1e-8) << name_of(parameter, robot);
    }
  }
}

TEST(Parameter, every_parameter_of_the_chassis_is_seen_by_rows_or_readings) {
  for (const Robot& robot : every_robot()) {
    const Rows rows = rows_of(robot.chassis, true);
    Increment increment = test::increment_of(robot.chassis, {0.5, 0.1, 0.3}, 0.2);
    increment.gyro_change_rad_s = 0.1;
    for (const Parameter& parameter : parameters_of(robot)) {
      const double seen = row_derivative(parameter, robot.chassis, rows).norm() +
                          reading_derivative(parameter, robot.chassis, rows, increment).norm();
      const bool of_reference = name_of(parameter, robot).starts_with("reference.");
      EXPECT_EQ(seen > 0.0, !of_reference) << name_of(parameter, robot);
    }
  }
}

TEST(Parameter, prior_sigmas_are_positive_and_as_documented) {
  for (const Robot& robot : every_robot())
    for (const Parameter& parameter : parameters_of(robot))
      EXPECT_GT(prior_sigma(parameter, robot), 0.0) << name_of(parameter, robot);
  const Robot robot = robot_of(differential_drive(kSize, 0.4));
  EXPECT_DOUBLE_EQ(prior_sigma({ParameterKind::diameter, 0}, robot), 0.05 * 0.15);
  EXPECT_DOUBLE_EQ(prior_sigma({ParameterKind::track}, robot), 0.2 * 0.4);
  EXPECT_EQ(prior_sigma({ParameterKind::direction, 0}, robot_of(omni3(kSize, 0.2))), radians(10));
}

}  // namespace
}  // namespace trundle::chassis
