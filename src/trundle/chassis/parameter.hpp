#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "trundle/chassis/robot.hpp"
#include "trundle/chassis/rows.hpp"

namespace trundle::chassis {

enum class ParameterKind {
  diameter,        ///< "left.diameter" [m]
  direction,       ///< "left.direction" [rad]: of rolling
  lever,           ///< "left.lever" [m]: the turn coefficient of the rolling row, px sin ψ − py cos ψ
  steering_zero,   ///< "front.steering_zero" [rad]: what its steering reads where it stands at its direction
  steering_scale,  ///< "front.steering_scale"
  place_x,         ///< "front.x" [m]: of a steered wheel
  place_y,         ///< "front.y" [m]
  track,           ///< "track" [m]: distance of the left wheels from the right ones; scales all y
  icr_x,           ///< "icr_x" [m]
  scrub,           ///< "scrub": share of a turn on the spot that skid wheels lose
  tyre_growth,     ///< "tyre_growth" [s²/m²]: share by which wheels roll further per square of their speed
  velocity_forward_scale,    ///< "velocity.forward_scale": of a robot without wheels, as the next three
  velocity_yaw_scale,        ///< "velocity.yaw_scale"
  velocity_yaw_per_forward,  ///< "velocity.yaw_per_forward" [rad/m]
  velocity_yaw_bias,         ///< "velocity.yaw_bias" [rad/s]
  gyro_scale,                ///< "gyro.scale"
  gyro_bias,                 ///< "gyro.bias" [rad/s]
  gyro_time_offset,          ///< "gyro.time_offset" [s]: added to the gyro's stamps
  reference_x,               ///< "reference.x" [m]: of the reference sensor on the robot
  reference_y,               ///< "reference.y" [m]
  reference_heading,         ///< "reference.heading" [rad]
  time_offset,               ///< "reference.time_offset" [s]: added to the reference's stamps
  sensor_range_offset,       ///< "sensor.range_offset" [m]: of the landmark sensor
  sensor_range_scale,        ///< "sensor.range_scale"
  sensor_bearing_offset,     ///< "sensor.bearing_offset" [rad]
  sensor_depth_share,        ///< "sensor.depth_share": 0: it reads distances, 1: depths
  sensor_x,                  ///< "sensor.x" [m]: of the landmark sensor on the robot
  sensor_y,                  ///< "sensor.y" [m]
  sensor_time_offset,        ///< "sensor.time_offset" [s]: added to the landmark sensor's stamps
};

/// One scalar of a robot that calibration may change and whose uncertainty odometry carries along.
struct Parameter {
  ParameterKind kind = ParameterKind::diameter;
  int wheel = -1;  ///< as Chassis::all_wheels()

  bool operator==(const Parameter&) const = default;
};
inline constexpr Parameter kGyroBias{ParameterKind::gyro_bias, -1};
inline constexpr Parameter kRangeScale{ParameterKind::sensor_range_scale, -1};

/// Of the landmark sensor: the motion of the robot does not depend on it.
[[nodiscard]] bool is_of_landmark_sensor(ParameterKind kind);

/// Of a velocity that somebody else computed.
[[nodiscard]] bool is_of_velocity(ParameterKind kind);

[[nodiscard]] std::string name_of(const Parameter& parameter, const Robot& robot);
/// "m", "rad", "rad/m", "rad/s", "s", "s²/m²" or "1".
[[nodiscard]] std::string_view unit_of(const Parameter& parameter);
[[nodiscard]] std::optional<Parameter> parameter_named(std::string_view name, const Robot& robot);
/// Every parameter this robot has.
[[nodiscard]] std::vector<Parameter> parameters_of(const Robot& robot);
/// Any of that kind.
[[nodiscard]] bool contains(std::span<const Parameter> parameters, ParameterKind kind);

[[nodiscard]] double value_of(const Parameter& parameter, const Robot& robot);
/// Changes that one scalar. `track` moves wheels; `lever` moves the wheel along its axle and a following
/// change of `direction` keeps the lever.
void set_value(const Parameter& parameter, double value, Robot& robot);

/// How far the value may plausibly be from nominal: 5 % of a diameter, 20 % of a track, 10° of a direction...
[[nodiscard]] double prior_sigma(const Parameter& parameter, const Robot& robot);

/// ∂H/∂p, and ∂z/∂p for one interval. Zero for parameters that are not in H. Of a steered chassis as it
/// stands in an interval: at_steering().
[[nodiscard]] RowMatrix row_derivative(const Parameter& parameter, const Chassis& chassis, const Rows& rows);
[[nodiscard]] RowVector reading_derivative(const Parameter& parameter, const Chassis& chassis,
                                           const Rows& rows, const Increment& increment);
/// ∂z/∂p as a share of z, for the parameters that scale readings; of a velocity's, of the noise of z, which
/// its yaw_per_forward and yaw_bias do not scale.
[[nodiscard]] RowVector reading_growth(const Parameter& parameter, const Chassis& chassis, const Rows& rows);

}  // namespace trundle::chassis
