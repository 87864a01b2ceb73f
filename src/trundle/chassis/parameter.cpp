#include "trundle/chassis/parameter.hpp"

#include <algorithm>
#include <limits>

#include "trundle/chassis/detail/parameter_parts.hpp"
#include "trundle/chassis/scrub.hpp"
#include "trundle/io/error.hpp"

namespace trundle::chassis {
namespace {

/// What there is to say of a kind of parameter.
struct Kind {
  ParameterKind kind;
  std::string_view word;  ///< of a wheel's parameter behind the wheel's name
  std::string_view unit;
  double sigma;  ///< 1σ about the robot file, in that unit; kBySize: prior_sigma() has it by the robot's size
};
constexpr double kBySize = 0.0;

constexpr Kind kOfWheels[] = {
    {ParameterKind::diameter, "diameter", "m", kBySize},
    {ParameterKind::direction, "direction", "rad", radians(10.0)},  // by eye
    {ParameterKind::lever, "lever", "m", kBySize},
    {ParameterKind::steering_zero, "steering_zero", "rad", radians(10.0)},  // by eye
    {ParameterKind::steering_scale, "steering_scale", "1", 0.05},  // of a potentiometer, of a linkage
    {ParameterKind::place_x, "x", "m", kBySize},
    {ParameterKind::place_y, "y", "m", kBySize},
};

constexpr Kind kOfRobot[] = {
    {ParameterKind::track, "track", "m", kBySize},
    {ParameterKind::icr_x, "icr_x", "m", 0.2},                     // as the load lies
    {ParameterKind::scrub, "scrub", "1", 0.2},                     // as the track, of which it is a share
    {ParameterKind::tyre_growth, "tyre_growth", "s^2/m^2", 0.05},  // a diameter's, at 1 m/s
    // Of somebody else's wheels the diameters; the track, which scrubbing adds to; diameters apart by 2 % on
    // a track of 40 cm; and the turns of a gyro before its first rest.
    {ParameterKind::velocity_forward_scale, "velocity.forward_scale", "1", 0.05},
    {ParameterKind::velocity_yaw_scale, "velocity.yaw_scale", "1", 0.1},
    {ParameterKind::velocity_yaw_per_forward, "velocity.yaw_per_forward", "rad/m", 0.05},
    {ParameterKind::velocity_yaw_bias, "velocity.yaw_bias", "rad/s", Gyro{}.bias_sigma_rad_s},
    // Data sheets of MEMS: 3 %, some degrees per second; some samples, and a bus.
    {ParameterKind::gyro_scale, "gyro.scale", "1", 0.05},
    {ParameterKind::gyro_bias, "gyro.bias", "rad/s", 0.05},
    {ParameterKind::gyro_time_offset, "gyro.time_offset", "s", 0.05},
    // Somewhere on the robot, often not aligned with it at all; two computers without a common clock.
    {ParameterKind::reference_x, "reference.x", "m", 0.2},
    {ParameterKind::reference_y, "reference.y", "m", 0.2},
    {ParameterKind::reference_heading, "reference.heading", "rad", radians(90.0)},
    {ParameterKind::time_offset, "reference.time_offset", "s", 0.5},
    // From the housing, or from the landmark's surface; sound in air: 2 % for 10 °C; by eye; either of two
    // habits: 0 or 1; by tape to a point inside of a housing; two computers again.
    {ParameterKind::sensor_range_offset, "sensor.range_offset", "m", 0.1},
    {ParameterKind::sensor_range_scale, "sensor.range_scale", "1", 0.02},
    {ParameterKind::sensor_bearing_offset, "sensor.bearing_offset", "rad", radians(10.0)},
    {ParameterKind::sensor_depth_share, "sensor.depth_share", "1", 0.5},
    {ParameterKind::sensor_x, "sensor.x", "m", 0.1},
    {ParameterKind::sensor_y, "sensor.y", "m", 0.1},
    {ParameterKind::sensor_time_offset, "sensor.time_offset", "s", 0.5},
};

/// Of a kind of either table.
const Kind& entry_of(ParameterKind kind) {
  const Kind* of_wheel = std::ranges::find(kOfWheels, kind, &Kind::kind);
  return of_wheel != std::ranges::end(kOfWheels) ? *of_wheel
                                                 : *std::ranges::find(kOfRobot, kind, &Kind::kind);
}

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
    case ParameterKind::tyre_growth:
      return chassis.wheel_count > 0;
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

/// The number of the robot file that a parameter is; null: it follows from several of them.
template <class AnyRobot>
auto* number_of(const Parameter& parameter, AnyRobot& robot) {
  auto& chassis = robot.chassis;
  auto& wheel = chassis.wheel_storage[static_cast<std::size_t>(std::max(parameter.wheel, 0))];
  switch (parameter.kind) {
    case ParameterKind::diameter:
      return &wheel.diameter_m;
    case ParameterKind::direction:
      return &wheel.direction_rad;
    case ParameterKind::steering_zero:
      return &wheel.steering->zero_rad;
    case ParameterKind::steering_scale:
      return &wheel.steering->scale;
    case ParameterKind::place_x:
      return &wheel.x_m;
    case ParameterKind::place_y:
      return &wheel.y_m;
    case ParameterKind::icr_x:
      return &chassis.icr_x_m;
    case ParameterKind::scrub:
      return &chassis.scrub;
    case ParameterKind::tyre_growth:
      return &chassis.tyre_growth_s2_m2;
    case ParameterKind::velocity_forward_scale:
      return &chassis.velocity.forward_scale;
    case ParameterKind::velocity_yaw_scale:
      return &chassis.velocity.yaw_scale;
    case ParameterKind::velocity_yaw_per_forward:
      return &chassis.velocity.yaw_per_forward_rad_m;
    case ParameterKind::velocity_yaw_bias:
      return &chassis.velocity.yaw_bias_rad_s;
    case ParameterKind::gyro_scale:
      return &chassis.gyro->scale;
    case ParameterKind::gyro_bias:
      return &chassis.gyro->bias_rad_s;
    case ParameterKind::gyro_time_offset:
      return &chassis.gyro->time_offset_s;
    case ParameterKind::reference_x:
      return &robot.body_from_reference.x;
    case ParameterKind::reference_y:
      return &robot.body_from_reference.y;
    case ParameterKind::reference_heading:
      return &robot.body_from_reference.heading;
    case ParameterKind::time_offset:
      return &robot.reference_time_offset_s;
    case ParameterKind::sensor_range_offset:
      return &robot.landmark_sensor->range_offset_m;
    case ParameterKind::sensor_range_scale:
      return &robot.landmark_sensor->range_scale;
    case ParameterKind::sensor_bearing_offset:
      return &robot.landmark_sensor->bearing_offset_rad;
    case ParameterKind::sensor_depth_share:
      return &robot.landmark_sensor->depth_share;
    case ParameterKind::sensor_x:
      return &robot.landmark_sensor->body_from_sensor.x;
    case ParameterKind::sensor_y:
      return &robot.landmark_sensor->body_from_sensor.y;
    case ParameterKind::sensor_time_offset:
      return &robot.landmark_sensor->time_offset_s;
    case ParameterKind::lever:
    case ParameterKind::track:
      break;
  }
  return decltype(&wheel.diameter_m){nullptr};
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
  const std::string word(entry_of(parameter.kind).word);
  return parameter.wheel < 0 ? word
                             : wheel_name(robot, static_cast<std::size_t>(parameter.wheel)) + "." + word;
}

std::string_view unit_of(const Parameter& parameter) {
  return entry_of(parameter.kind).unit;
}

std::vector<Parameter> parameters_of(const Robot& robot) {
  std::vector<Parameter> parameters;
  const auto offer = [&](const Parameter& parameter) {
    if (exists(parameter, robot)) parameters.push_back(parameter);
  };
  for (int wheel = 0; wheel < robot.chassis.wheel_count + robot.chassis.passive_count; ++wheel)
    for (const Kind& one : kOfWheels) offer({one.kind, wheel});
  for (const Kind& one : kOfRobot) offer({one.kind, -1});
  return parameters;
}

bool contains(std::span<const Parameter> parameters, ParameterKind kind) {
  return std::ranges::find(parameters, kind, &Parameter::kind) != parameters.end();
}

std::optional<Parameter> parameter_named(std::string_view name, const Robot& robot) {
  for (const Parameter& parameter : parameters_of(robot))
    if (name_of(parameter, robot) == name) return parameter;
  return std::nullopt;
}

double value_of(const Parameter& parameter, const Robot& robot) {
  if (const double* number = number_of(parameter, robot)) return *number;
  return parameter.kind == ParameterKind::track ? track_sides(robot.chassis).track()
                                                : rolling_row(wheel_of(parameter, robot.chassis)).z();
}

void set_value(const Parameter& parameter, double value, Robot& robot) {
  Chassis& chassis = robot.chassis;
  Wheel& wheel = chassis.wheel_storage[static_cast<std::size_t>(std::max(parameter.wheel, 0))];
  switch (parameter.kind) {
    case ParameterKind::direction: {
      const double lever = rolling_row(wheel).z();
      wheel.direction_rad = value;
      return set_lever(wheel, lever);
    }
    case ParameterKind::lever:
      return set_lever(wheel, value);
    case ParameterKind::track:
      return set_track(chassis, value);
    default:
      *number_of(parameter, robot) = value;
  }
}

double prior_sigma(const Parameter& parameter, const Robot& robot) {
  switch (parameter.kind) {
    case ParameterKind::diameter:  // load, pressure, wear
      return 0.05 * value_of(parameter, robot);
    case ParameterKind::place_x:  // by tape, to a contact that a caster moves
    case ParameterKind::place_y:
      return std::max(0.1 * largest_distance(robot.chassis), 0.01);
    case ParameterKind::lever:  // tape to a contact that is not seen; where all are short, its 1 cm
      return std::max(0.2 * largest_lever(robot.chassis), 0.01);
    case ParameterKind::track:  // wide wheels touch the ground anywhere across their width
      return 0.2 * value_of(parameter, robot);
    default:
      return entry_of(parameter.kind).sigma;
  }
}

}  // namespace trundle::chassis
