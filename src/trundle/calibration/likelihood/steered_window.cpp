#include "trundle/calibration/likelihood/steered_window.hpp"

#include <cmath>
#include <utility>

namespace trundle::calibration {
namespace {

/// With its wheels at the angles at which the motion by all readings has them. Derivatives at what was read
/// go with the very error that y is made of: of a tricycle's wheelbase and steering scale together they were
/// nothing else, and made them zero. docs/theory/calibration-redundancy.md, eq. 7a.
Chassis at_estimated_angles(Chassis standing, const Rows& rows, const Vector3& motion) {
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (row.kind != RowKind::lateral) continue;
    Wheel& wheel = standing.all_wheels()[static_cast<std::size_t>(row.wheel)];
    const double rolled_m = rolling_row(wheel).dot(motion), skid_m = rows.H.row(i).dot(motion);
    if (wheel.steering && rolled_m != 0.0)
      wheel.steering->reading_rad += std::atan(skid_m / rolled_m) / wheel.steering->scale;
  }
  return standing;
}

}  // namespace

bool SteeredWindow::take(const Increment& increment) {
  const bool with_gyro = chassis_.gyro.has_value();
  const Chassis standing = at_steering(chassis_, increment);
  Rows rows = rows_at(chassis_, increment, with_gyro);
  if (rows.row[static_cast<std::size_t>(rows.count() - 1)].kind == RowKind::unobserved) return false;
  rows.measured = rows.count();  // that a wheel does not skid is a reading: of its angle
  const Vector3 motion = estimated_motion(standing, rows, increment);
  const Chassis driven =  // of one that does not roll, no motion shows the angles
      any_turns(increment) ? at_estimated_angles(standing, rows, motion) : standing;
  Rows driven_rows = rows_of(driven, with_gyro);
  if (driven_rows.count() != rows.count()) return false;
  driven_rows.measured = rows.measured;
  const Combinations P = sum_ ? nearest_null_space(P_, rows) : left_null_space(rows);
  if (P.cols() == 0) return false;
  const RowVector variance = noise_of(standing, rows, motion, increment.duration_s);
  const Contradiction own =
      contradiction_of(comparison_of(standing, rows, driven, driven_rows, P, parameters_), increment, motion,
                       variance, with_errors_);
  if (!sum_) {
    P_ = P;
    sum_ = own;
    sum_->S += combined_covariance(P, rounding_of(standing, rows));
  } else {
    sum_->add(own);
  }
  duration_s_ += increment.duration_s;
  last_ = Taken{increment, rows, variance, P};
  return true;
}

CommonError SteeredWindow::common_error(double speed_m_s) const {
  const auto& [increment, rows, variance, P] = *last_;
  const Chassis standing = at_steering(weighing_, increment);
  const TwistGain gain = twist_gain(rows, weighing_variances(standing, rows, speed_m_s, 1.0));
  return gain * variance.asDiagonal() * P;
}

std::optional<Contradiction> SteeredWindow::close() {
  duration_s_ = 0.0;
  return std::exchange(sum_, std::nullopt);
}

}  // namespace trundle::calibration
