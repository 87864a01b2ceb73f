#include "trundle/chassis/parameter.hpp"

#include <algorithm>
#include <cassert>
#include <limits>

#include "trundle/chassis/detail/parameter_parts.hpp"
#include "trundle/chassis/scrub.hpp"
#include "trundle/io/error.hpp"

namespace trundle::chassis {
namespace {

constexpr std::pair<ParameterKind, std::string_view> kWheelParameters[] = {
    {ParameterKind::diameter, "diameter"},
    {ParameterKind::direction, "direction"},
    {ParameterKind::lever, "lever"},
    {ParameterKind::steering_zero, "steering_zero"},
    {ParameterKind::steering_scale, "steering_scale"},
    {ParameterKind::place_x, "x"},
    {ParameterKind::place_y, "y"}};

constexpr std::pair<ParameterKind, std::string_view> kRobotParameters[] = {
    {ParameterKind::track, "track"},
    {ParameterKind::icr_x, "icr_x"},
    {ParameterKind::scrub, "scrub"},
    {ParameterKind::velocity_forward_scale, "velocity.forward_scale"},
    {ParameterKind::velocity_yaw_scale, "velocity.yaw_scale"},
    {ParameterKind::velocity_yaw_per_forward, "velocity.yaw_per_forward"},
    {ParameterKind::velocity_yaw_bias, "velocity.yaw_bias"},
    {ParameterKind::gyro_scale, "gyro.scale"},
    {ParameterKind::gyro_bias, "gyro.bias"},
    {ParameterKind::gyro_time_offset, "gyro.time_offset"},
    {ParameterKind::reference_x, "reference.x"},
    {ParameterKind::reference_y, "reference.y"},
    {ParameterKind::reference_heading, "reference.heading"},
    {ParameterKind::time_offset, "reference.time_offset"},
    {ParameterKind::sensor_range_offset, "sensor.range_offset"},
    {ParameterKind::sensor_range_scale, "sensor.range_scale"},
    {ParameterKind::sensor_bearing_offset, "sensor.bearing_offset"},
    {ParameterKind::sensor_depth_share, "sensor.depth_share"},
    {ParameterKind::sensor_x, "sensor.x"},
    {ParameterKind::sensor_y, "sensor.y"},
    {ParameterKind::sensor_time_offset, "sensor.time_offset"},
};

void set_lever(Wheel& wheel, double lever) {
  const Vector2 gradient = lever_gradient(wheel);
  const Vector2 shift = (lever - rolling_row(wheel).z()) / gradient.squaredNorm() * gradient;
  wheel.x_m += shift.x();
  wheel.y_m += shift.y();
}

void set_track(Chassis& chassis, double track) {
  const Sides sides = track_sides(chassis);
  for (Wheel& wheel : chassis.wheels())
    if (is_of_side(wheel)) wheel.y_m = sides.middle() + (wheel.y_m - sides.middle()) * track / sides.track();
}

bool exists(const Parameter& parameter, const Robot& robot) {
  const Chassis& chassis = robot.chassis;
  if (is_of_landmark_sensor(parameter.kind)) return robot.landmark_sensor.has_value();
  if (is_of_velocity(parameter.kind)) return chassis.wheel_count == 0;
  switch (parameter.kind) {
    case ParameterKind::diameter:
      return parameter.wheel < chassis.wheel_count;
    case ParameterKind::lever:  // of a steered wheel another one in each interval: it has a place
      return parameter.wheel < chassis.wheel_count && !wheel_of(parameter, chassis).steering;
    case ParameterKind::steering_zero:
    case ParameterKind::steering_scale:
    case ParameterKind::place_x:
    case ParameterKind::place_y:
      return wheel_of(parameter, chassis).steering.has_value();
    case ParameterKind::direction:
      return has_rollers(wheel_of(parameter, chassis).kind);
    case ParameterKind::track:
      return sides_of(chassis).has_value();
    case ParameterKind::icr_x:
      return has_skid_wheels(chassis);
    case ParameterKind::scrub:
      return can_scrub(chassis);
    case ParameterKind::gyro_scale:
    case ParameterKind::gyro_bias:
    case ParameterKind::gyro_time_offset:
      return chassis.gyro.has_value();
    default:
      return true;
  }
}

/// Of a wheel from the origin.
double largest_distance(const Chassis& chassis) {
  double largest = 0.0;
  for (const Wheel& wheel : chassis.all_wheels())
    largest = std::max(largest, std::hypot(wheel.x_m, wheel.y_m));
  return largest;
}

double largest_lever(const Chassis& chassis) {
  double largest = 0.0;
  for (const Wheel& wheel : chassis.wheels()) largest = std::max(largest, std::abs(rolling_row(wheel).z()));
  return largest;
}

/// The number of a velocity's correction that a parameter is.
template <class Correction>
auto& velocity_value(ParameterKind kind, Correction& velocity) {
  switch (kind) {
    case ParameterKind::velocity_forward_scale:
      return velocity.forward_scale;
    case ParameterKind::velocity_yaw_scale:
      return velocity.yaw_scale;
    case ParameterKind::velocity_yaw_per_forward:
      return velocity.yaw_per_forward_rad_m;
    default:
      return velocity.yaw_bias_rad_s;
  }
}

/// The number of a landmark sensor that a parameter is.
template <class Sensor>
auto& sensor_value(ParameterKind kind, Sensor& sensor) {
  switch (kind) {
    case ParameterKind::sensor_range_offset:
      return sensor.range_offset_m;
    case ParameterKind::sensor_range_scale:
      return sensor.range_scale;
    case ParameterKind::sensor_bearing_offset:
      return sensor.bearing_offset_rad;
    case ParameterKind::sensor_depth_share:
      return sensor.depth_share;
    case ParameterKind::sensor_x:
      return sensor.body_from_sensor.x;
    case ParameterKind::sensor_y:
      return sensor.body_from_sensor.y;
    default:
      return sensor.time_offset_s;
  }
}

}  // namespace

std::optional<Sides> sides_of(const Chassis& chassis) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Wheel& wheel : chassis.wheels())
    if (is_of_side(wheel)) low = std::min(low, wheel.y_m), high = std::max(high, wheel.y_m);
  const double middle = 0.5 * (low + high);
  Sides sides;
  int left_count = 0;
  int right_count = 0;
  for (const Wheel& wheel : chassis.wheels()) {
    if (!is_of_side(wheel)) continue;
    if (wheel.y_m > middle) sides.left += wheel.y_m, ++left_count;
    if (wheel.y_m < middle) sides.right += wheel.y_m, ++right_count;
  }
  if (left_count == 0 || right_count == 0) return std::nullopt;
  return Sides{sides.left / left_count, sides.right / right_count};
}

Sides track_sides(const Chassis& chassis) {
  if (const auto sides = sides_of(chassis)) return *sides;
  throw CannotAnswer("the wheels of both sides come out at one place: the data do not show the track");
}

bool is_of_landmark_sensor(ParameterKind kind) {
  return kind >= ParameterKind::sensor_range_offset && kind <= ParameterKind::sensor_time_offset;
}

bool is_of_velocity(ParameterKind kind) {
  return kind >= ParameterKind::velocity_forward_scale && kind <= ParameterKind::velocity_yaw_bias;
}

std::string name_of(const Parameter& parameter, const Robot& robot) {
  for (const auto& [kind, word] : kWheelParameters)
    if (kind == parameter.kind)
      return wheel_name(robot, static_cast<std::size_t>(parameter.wheel)) + "." + std::string(word);
  for (const auto& [kind, word] : kRobotParameters)
    if (kind == parameter.kind) return std::string(word);
  assert(false);
  return {};
}

std::string_view unit_of(const Parameter& parameter) {
  switch (parameter.kind) {
    case ParameterKind::direction:
    case ParameterKind::reference_heading:
    case ParameterKind::steering_zero:
    case ParameterKind::sensor_bearing_offset:
      return "rad";
    case ParameterKind::steering_scale:
    case ParameterKind::scrub:
    case ParameterKind::sensor_range_scale:
    case ParameterKind::sensor_depth_share:
    case ParameterKind::gyro_scale:
    case ParameterKind::velocity_forward_scale:
    case ParameterKind::velocity_yaw_scale:
      return "1";
    case ParameterKind::velocity_yaw_per_forward:
      return "rad/m";
    case ParameterKind::gyro_bias:
    case ParameterKind::velocity_yaw_bias:
      return "rad/s";
    case ParameterKind::gyro_time_offset:
    case ParameterKind::time_offset:
    case ParameterKind::sensor_time_offset:
      return "s";
    default:
      return "m";
  }
}

std::vector<Parameter> parameters_of(const Robot& robot) {
  std::vector<Parameter> parameters;
  const auto offer = [&](const Parameter& parameter) {
    if (exists(parameter, robot)) parameters.push_back(parameter);
  };
  for (int wheel = 0; wheel < robot.chassis.wheel_count + robot.chassis.passive_count; ++wheel)
    for (const auto& [kind, word] : kWheelParameters) offer({kind, wheel});
  for (const auto& [kind, word] : kRobotParameters) offer({kind, -1});
  return parameters;
}

std::optional<Parameter> parameter_named(std::string_view name, const Robot& robot) {
  for (const Parameter& parameter : parameters_of(robot))
    if (name_of(parameter, robot) == name) return parameter;
  return std::nullopt;
}

double value_of(const Parameter& parameter, const Robot& robot) {
  const Chassis& chassis = robot.chassis;
  if (is_of_velocity(parameter.kind)) return velocity_value(parameter.kind, chassis.velocity);
  switch (parameter.kind) {
    case ParameterKind::diameter:
      return wheel_of(parameter, chassis).diameter_m;
    case ParameterKind::direction:
      return wheel_of(parameter, chassis).direction_rad;
    case ParameterKind::lever:
      return rolling_row(wheel_of(parameter, chassis)).z();
    case ParameterKind::steering_zero:
      return wheel_of(parameter, chassis).steering->zero_rad;
    case ParameterKind::steering_scale:
      return wheel_of(parameter, chassis).steering->scale;
    case ParameterKind::place_x:
      return wheel_of(parameter, chassis).x_m;
    case ParameterKind::place_y:
      return wheel_of(parameter, chassis).y_m;
    case ParameterKind::track:
      return track_sides(chassis).track();
    case ParameterKind::icr_x:
      return chassis.icr_x_m;
    case ParameterKind::scrub:
      return chassis.scrub;
    case ParameterKind::gyro_scale:
      return chassis.gyro->scale;
    case ParameterKind::gyro_bias:
      return chassis.gyro->bias_rad_s;
    case ParameterKind::gyro_time_offset:
      return chassis.gyro->time_offset_s;
    case ParameterKind::reference_x:
      return robot.body_from_reference.x;
    case ParameterKind::reference_y:
      return robot.body_from_reference.y;
    case ParameterKind::reference_heading:
      return robot.body_from_reference.heading;
    case ParameterKind::time_offset:
      return robot.reference_time_offset_s;
    default:
      return sensor_value(parameter.kind, *robot.landmark_sensor);
  }
  return 0.0;
}

void set_value(const Parameter& parameter, double value, Robot& robot) {
  Chassis& chassis = robot.chassis;
  if (is_of_velocity(parameter.kind)) {
    velocity_value(parameter.kind, chassis.velocity) = value;
    return;
  }
  Wheel& wheel = chassis.wheel_storage[static_cast<std::size_t>(std::max(parameter.wheel, 0))];
  switch (parameter.kind) {
    case ParameterKind::diameter:
      wheel.diameter_m = value;
      break;
    case ParameterKind::direction: {
      const double lever = rolling_row(wheel).z();
      wheel.direction_rad = value;
      set_lever(wheel, lever);
      break;
    }
    case ParameterKind::lever:
      set_lever(wheel, value);
      break;
    case ParameterKind::steering_zero:
      wheel.steering->zero_rad = value;
      break;
    case ParameterKind::steering_scale:
      wheel.steering->scale = value;
      break;
    case ParameterKind::place_x:
      wheel.x_m = value;
      break;
    case ParameterKind::place_y:
      wheel.y_m = value;
      break;
    case ParameterKind::track:
      set_track(chassis, value);
      break;
    case ParameterKind::icr_x:
      chassis.icr_x_m = value;
      break;
    case ParameterKind::scrub:
      chassis.scrub = value;
      break;
    case ParameterKind::gyro_scale:
      chassis.gyro->scale = value;
      break;
    case ParameterKind::gyro_bias:
      chassis.gyro->bias_rad_s = value;
      break;
    case ParameterKind::gyro_time_offset:
      chassis.gyro->time_offset_s = value;
      break;
    case ParameterKind::reference_x:
      robot.body_from_reference.x = value;
      break;
    case ParameterKind::reference_y:
      robot.body_from_reference.y = value;
      break;
    case ParameterKind::reference_heading:
      robot.body_from_reference.heading = value;
      break;
    case ParameterKind::time_offset:
      robot.reference_time_offset_s = value;
      break;
    default:
      sensor_value(parameter.kind, *robot.landmark_sensor) = value;
  }
}

double prior_sigma(const Parameter& parameter, const Robot& robot) {
  switch (parameter.kind) {
    case ParameterKind::diameter:  // load, pressure, wear
      return 0.05 * value_of(parameter, robot);
    case ParameterKind::direction:  // by eye
    case ParameterKind::steering_zero:
      return radians(10.0);
    case ParameterKind::steering_scale:  // of a potentiometer, or a linkage that is not quite straight
      return 0.05;
    case ParameterKind::place_x:  // by tape, to a contact that a caster moves
    case ParameterKind::place_y:
      return std::max(0.1 * largest_distance(robot.chassis), 0.01);
    case ParameterKind::lever:  // tape to a contact that is not seen; where all are short, its 1 cm
      return std::max(0.2 * largest_lever(robot.chassis), 0.01);
    case ParameterKind::track:  // wide wheels touch the ground anywhere across their width
      return 0.2 * value_of(parameter, robot);
    case ParameterKind::icr_x:  // [m]: as the load lies
      return 0.2;
    case ParameterKind::scrub:  // as the track, of which it is a share
      return 0.2;
    case ParameterKind::velocity_forward_scale:  // the diameters of somebody else's wheels
      return 0.05;
    case ParameterKind::velocity_yaw_scale:  // and their track, which scrubbing adds to
      return 0.1;
    case ParameterKind::velocity_yaw_per_forward:  // [rad/m]: diameters apart by 2 % on a track of 40 cm
      return 0.05;
    case ParameterKind::velocity_yaw_bias:  // [rad/s]: of a gyro's turns before its first rest
      return Gyro{}.bias_sigma_rad_s;
    case ParameterKind::gyro_scale:  // data sheets of MEMS: 3 %
      return 0.05;
    case ParameterKind::gyro_bias:  // [rad/s]: data sheets of MEMS, some degrees per second
      return 0.05;
    case ParameterKind::gyro_time_offset:  // [s]: some samples, and a bus
      return 0.05;
    case ParameterKind::reference_x:
    case ParameterKind::reference_y:  // [m]: somewhere on the robot
      return 0.2;
    case ParameterKind::reference_heading:  // markers are often not aligned with the body at all
      return radians(90.0);
    case ParameterKind::time_offset:  // [s]: two computers without a common clock
    case ParameterKind::sensor_time_offset:
      return 0.5;
    case ParameterKind::sensor_range_offset:  // [m]: from the housing, or from the landmark's surface
    case ParameterKind::sensor_x:
    case ParameterKind::sensor_y:  // by tape to a point inside of a housing
      return 0.1;
    case ParameterKind::sensor_range_scale:  // sound in air: 2 % for 10 °C
      return 0.02;
    case ParameterKind::sensor_bearing_offset:  // by eye
      return radians(10.0);
    case ParameterKind::sensor_depth_share:  // either of two habits: 0 or 1
      return 0.5;
  }
  return 0.0;
}

}  // namespace trundle::chassis
