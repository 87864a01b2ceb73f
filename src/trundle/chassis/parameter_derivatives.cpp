// How rows of H and their readings change with a parameter.
#include "trundle/chassis/detail/parameter_parts.hpp"
#include "trundle/chassis/ground_turned.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::chassis {
namespace {

Vector3 direction_derivative(const Wheel& wheel) {
  const Vector3 row = rolling_row(wheel);
  return {-row.y(), row.x(), 0.0};  // the lever is held
}

void set_track_derivative(const Chassis& chassis, const Rows& rows, RowMatrix& derivative) {
  const Sides sides = track_sides(chassis);
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    const bool is_of_wheel =
        (row.kind == RowKind::wheel || row.kind == RowKind::lateral) && row.wheel < chassis.wheel_count;
    if (!is_of_wheel) continue;
    const Wheel& wheel = chassis.wheels()[static_cast<std::size_t>(row.wheel)];
    if (!is_of_side(wheel)) continue;
    const double dy = (wheel.y_m - sides.middle()) / sides.track();
    const double dturn_dy =
        row.kind == RowKind::wheel ? lever_gradient(wheel).y() : std::sin(rolling_direction(wheel));
    derivative(i, 2) = dturn_dy * dy;
  }
}

/// ∂(rolling direction)/∂p of a steered wheel.
double turn_by(ParameterKind kind, const SteeringSensor& steering) {
  if (kind == ParameterKind::steering_zero) return -steering.scale;
  if (kind == ParameterKind::steering_scale) return steering.reading_rad - steering.zero_rad;
  return 0.0;
}

/// ∂h/∂p of a row of a steered wheel: ∂d/∂ψ = n, ∂n/∂ψ = −d, and both change in proportion to its place.
Vector3 steered_derivative(ParameterKind kind, RowKind row, const Wheel& wheel) {
  const Vector3 d = rolling_row(wheel), n = lateral_row(wheel);
  const bool rolls = row == RowKind::wheel;
  if (kind == ParameterKind::place_x) return {0.0, 0.0, rolls ? d.y() : n.y()};
  if (kind == ParameterKind::place_y) return {0.0, 0.0, rolls ? -d.x() : -n.x()};
  return turn_by(kind, *wheel.steering) * (rolls ? n : Vector3(-d));
}

bool is_of_steered_wheel(ParameterKind kind) {
  switch (kind) {
    case ParameterKind::steering_zero:
    case ParameterKind::steering_scale:
    case ParameterKind::place_x:
    case ParameterKind::place_y:
      return true;
    default:
      return false;
  }
}

/// The two that scale a reading.
bool is_diameter_of(const Parameter& parameter, const Row& row) {
  return parameter.kind == ParameterKind::diameter && row.kind == RowKind::wheel &&
         row.wheel == parameter.wheel;
}

bool is_scale_of(const Parameter& parameter, const Row& row) {
  return parameter.kind == ParameterKind::gyro_scale && row.kind == RowKind::gyro;
}

/// ∂z/∂p of a velocity's row. docs/theory/velocity.md, eq. 1.
double velocity_derivative(ParameterKind kind, RowKind row, const Increment& increment) {
  const bool is_turn = row == RowKind::turn;
  switch (kind) {
    case ParameterKind::velocity_forward_scale:
      return row == RowKind::forward ? increment.turned[0] : 0.0;
    case ParameterKind::velocity_yaw_scale:
      return is_turn ? increment.turned[1] : 0.0;
    case ParameterKind::velocity_yaw_per_forward:
      return is_turn ? increment.turned[0] : 0.0;
    case ParameterKind::velocity_yaw_bias:
      return is_turn ? increment.duration_s : 0.0;
    default:
      return 0.0;
  }
}

/// docs/theory/scrub.md, eq. 4.
double scrub_derivative(const Chassis& chassis, std::size_t wheel, const Increment& increment) {
  return -kPi * chassis.wheels()[wheel].diameter_m * scrub_sides(chassis)[wheel] * increment.scrub_turned;
}

/// docs/theory/tyre-growth.md, eq. 3: a larger wheel is faster, too.
double diameter_derivative(const Chassis& chassis, std::size_t wheel, const Increment& increment) {
  double turned = ground_turned(chassis, wheel, increment);
  if (chassis.tyre_growth_s2_m2 != 0.0)
    turned += 2.0 * growth_of(chassis, wheel) * increment.speed_turned[wheel];
  return kPi * turned;
}

double growth_derivative(const Chassis& chassis, std::size_t wheel, const Increment& increment) {
  const double circumference_m = kPi * chassis.wheels()[wheel].diameter_m;
  return circumference_m * circumference_m * circumference_m * increment.speed_turned[wheel];
}

}  // namespace

RowMatrix row_derivative(const Parameter& parameter, const Chassis& chassis, const Rows& rows) {
  RowMatrix derivative = RowMatrix::Zero(rows.count(), 3);
  if (parameter.kind == ParameterKind::track) set_track_derivative(chassis, rows, derivative);
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    const bool own_wheel = row.kind == RowKind::wheel && row.wheel == parameter.wheel;
    const bool of_wheel = own_wheel || (row.kind == RowKind::lateral && row.wheel == parameter.wheel);
    if (of_wheel && is_of_steered_wheel(parameter.kind))
      derivative.row(i) =
          steered_derivative(parameter.kind, row.kind, wheel_of(parameter, chassis)).transpose();
    if (parameter.kind == ParameterKind::direction && own_wheel)
      derivative.row(i) = direction_derivative(wheel_of(parameter, chassis)).transpose();
    if (parameter.kind == ParameterKind::lever && own_wheel) derivative(i, 2) = 1.0;
    if (parameter.kind == ParameterKind::icr_x && row.kind == RowKind::skid_lateral) derivative(i, 2) = -1.0;
  }
  return derivative;
}

RowVector reading_growth(const Parameter& parameter, const Chassis& chassis, const Rows& rows) {
  RowVector growth = RowVector::Zero(rows.count());
  for (int i = 0; i < rows.measured; ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (is_diameter_of(parameter, row))
      growth[i] = 1.0 / chassis.wheels()[static_cast<std::size_t>(row.wheel)].diameter_m;
    if (is_scale_of(parameter, row)) growth[i] = 1.0 / chassis.gyro->scale;
    if (parameter.kind == ParameterKind::velocity_forward_scale && row.kind == RowKind::forward)
      growth[i] = 1.0 / chassis.velocity.forward_scale;
    if (parameter.kind == ParameterKind::velocity_yaw_scale && row.kind == RowKind::turn)
      growth[i] = 1.0 / chassis.velocity.yaw_scale;
  }
  return growth;
}

RowVector reading_derivative(const Parameter& parameter, const Chassis& chassis, const Rows& rows,
                             const Increment& increment) {
  RowVector derivative = RowVector::Zero(rows.count());
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (is_of_velocity(parameter.kind))
      derivative[i] = velocity_derivative(parameter.kind, row.kind, increment);
    if (is_diameter_of(parameter, row))
      derivative[i] = diameter_derivative(chassis, static_cast<std::size_t>(row.wheel), increment);
    if (parameter.kind == ParameterKind::tyre_growth && row.kind == RowKind::wheel)
      derivative[i] = growth_derivative(chassis, static_cast<std::size_t>(row.wheel), increment);
    if (parameter.kind == ParameterKind::scrub && row.kind == RowKind::wheel)
      derivative[i] = scrub_derivative(chassis, static_cast<std::size_t>(row.wheel), increment);
    if (is_scale_of(parameter, row))
      derivative[i] = increment.gyro_rad - chassis.gyro->bias_rad_s * increment.duration_s;
    if (parameter.kind == ParameterKind::gyro_bias && row.kind == RowKind::gyro)
      derivative[i] = -chassis.gyro->scale * increment.duration_s;
    if (parameter.kind == ParameterKind::gyro_time_offset && row.kind == RowKind::gyro)
      derivative[i] = -chassis.gyro->scale * increment.gyro_change_rad_s;
  }
  return derivative;
}

}  // namespace trundle::chassis
