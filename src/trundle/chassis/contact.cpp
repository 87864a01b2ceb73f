#include "trundle/chassis/contact.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trundle/chassis/ground_turned.hpp"
#include "trundle/chassis/without_wheel.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::chassis {
namespace {

/// Every wheel with an encoder rolls ahead, and passive ones that are steered say nothing.
Chassis with_steering_ahead(const Chassis& chassis) {
  Chassis ahead = chassis;
  for (std::size_t i = 0; i < ahead.all_wheels().size(); ++i) {
    Wheel& wheel = ahead.all_wheels()[i];
    if (!wheel.steering) continue;
    wheel.direction_rad = 0.0;
    wheel.steering->reading_rad = wheel.steering->zero_rad;
    if (i >= ahead.wheels().size()) wheel.kind = WheelKind::omni;
  }
  return ahead;
}

/// Of the count between the last interval and the next one, along (c, s).
void add_rounding(double c, double s, double variance, ContactMotion& contact) {
  const double dx = c - std::exchange(contact.last_x, c), dy = s - std::exchange(contact.last_y, s);
  contact.variance_xx += variance * dx * dx;
  contact.variance_xy += variance * dx * dy;
  contact.variance_yy += variance * dy * dy;
}

}  // namespace

bool has_steered_encoders(const Chassis& chassis) {
  return std::ranges::any_of(chassis.wheels(), [](const Wheel& w) { return w.steering.has_value(); });
}

Rows checking_rows(const Chassis& chassis, bool with_gyro) {
  if (const std::optional<Chassis> fixed = without_steering(chassis)) return rows_of(*fixed, with_gyro);
  Rows rows = rows_of(with_steering_ahead(chassis), with_gyro);
  rows.measured = rows.count();
  return rows;
}

double misreading_variance(const Wheel& wheel, double travel_m) {
  return squared(wheel.steering->scale * wheel.steering->sigma_rad * travel_m);
}

RowVector misreading_variances(const Chassis& chassis, const Rows& rows, const Vector3& motion) {
  RowVector variance = RowVector::Zero(rows.count());
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (!is_of_angle(chassis, row)) continue;
    const Wheel& wheel = chassis.all_wheels()[static_cast<std::size_t>(row.wheel)];
    variance[i] = misreading_variance(wheel, rolling_row(wheel).dot(motion));
  }
  return variance;
}

void add_interval(const Chassis& chassis, const Increment& increment, ContactMotions& contacts) {
  const double mean_m = mean_travel(chassis, increment);
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    Wheel wheel = chassis.wheels()[i];
    if (!wheel.steering) continue;
    wheel.steering->reading_rad = increment.steering_rad[i];
    const double travel_m = kPi * wheel.diameter_m * ground_turned(chassis, i, increment);
    const double c = std::cos(rolling_direction(wheel)), s = std::sin(rolling_direction(wheel));
    const double along = rolling_variance(chassis, i, std::abs(travel_m));
    const double across = lateral_variance(chassis, mean_m) + misreading_variance(wheel, travel_m);
    ContactMotion& contact = contacts[i];
    if (travel_m != 0.0) add_rounding(c, s, rounding_variance(wheel), contact);
    contact.x_m += travel_m * c;
    contact.y_m += travel_m * s;
    contact.variance_xx += along * c * c + across * s * s;
    contact.variance_xy += (along - across) * c * s;
    contact.variance_yy += along * s * s + across * c * c;
  }
}

}  // namespace trundle::chassis
