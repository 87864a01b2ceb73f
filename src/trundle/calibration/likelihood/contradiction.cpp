#include "trundle/calibration/likelihood/contradiction.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/chassis/contact.hpp"
#include "trundle/chassis/ground_turned.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::calibration {
namespace {

/// What a motion makes the wheels read.
Increment predicted(const Chassis& chassis, const Rows& rows, const Vector3& motion, double duration_s) {
  Increment increment{.duration_s = duration_s, .has_gyro = true};
  for (int i = 0; i < rows.measured; ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    const auto wheel = static_cast<std::size_t>(std::max(row.wheel, 0));
    const double z = rows.H.row(i).dot(motion);
    if (row.kind == RowKind::wheel) increment.turned[wheel] = z / (kPi * chassis.wheels()[wheel].diameter_m);
  }
  if (chassis.wheel_count > 0) return increment;
  const ForwardAndTurn read = read_as(chassis.velocity, {motion.x(), motion.z()}, duration_s);
  increment.turned[0] = read.forward_m;
  increment.turned[1] = read.turn_rad;
  return increment;
}

/// What a motion makes the wheels scrub, in turns as sharp as those that were read. Where they went to and
/// fro the share of all is no sharpness of any: it is kept within what one may be. docs/theory/scrub.md,
/// eq. 5.
Increment with_scrub_of(const Increment& sum, const Chassis& chassis, Increment predicted) {
  const double read = half_difference(chassis, sum.turned);
  const double sharp = read == 0.0 ? 0.0 : std::clamp(sum.scrub_turned / read, 0.0, 1.0);
  predicted.scrub_turned = sharp / (1.0 - chassis.scrub * sharp) * half_difference(chassis, predicted.turned);
  return predicted;
}

/// What a motion makes the wheels turn times the square of their speed, which is that of what they read.
/// Where they went to and fro it is no speed of any: it is kept within that of a wheel that rests for nine
/// tenths of the time. docs/theory/tyre-growth.md, eq. 5.
Increment with_speed_of(const Increment& sum, const Chassis& chassis, Increment predicted) {
  constexpr double kMoves = 0.1;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    const double read = sum.turned[i];
    const double most = squared(read / (kMoves * sum.duration_s));
    const double square = read == 0.0 ? 0.0 : std::clamp(sum.speed_turned[i] / read, 0.0, most);
    predicted.speed_turned[i] = square / (1.0 + growth_of(chassis, i) * square) * predicted.turned[i];
  }
  return predicted;
}

/// ∂(z / σ)/∂p · σ with z as the motion predicts it: a diameter scales reading and noise alike.
RowVector predicted_derivative(const Comparison& comparison, const Parameter& parameter, const Vector3& twist,
                               const Increment& sum) {
  const Rows& rows = comparison.driven_rows;
  const auto motion = [&] { return predicted(comparison.driven, rows, twist, sum.duration_s); };
  if (is_of_velocity(parameter.kind)) return reading_derivative(parameter, comparison.driven, rows, motion());
  if (parameter.kind == ParameterKind::gyro_bias || parameter.kind == ParameterKind::gyro_time_offset)
    return reading_derivative(parameter, comparison.driven, rows, sum);
  if (parameter.kind == ParameterKind::scrub)
    return reading_derivative(parameter, comparison.driven, rows,
                              with_scrub_of(sum, comparison.driven, motion()));
  if (parameter.kind == ParameterKind::tyre_growth)
    return reading_derivative(parameter, comparison.driven, rows,
                              with_speed_of(sum, comparison.driven, motion()));
  return reading_growth(parameter, comparison.driven, rows).cwiseProduct(rows.H * twist);
}

}  // namespace

RowVector rounding_of(const Chassis& chassis, const Rows& rows) {
  RowVector variance = RowVector::Zero(rows.count());
  for (int i = 0; i < rows.measured; ++i)
    if (const Row& row = rows.row[static_cast<std::size_t>(i)]; row.kind == RowKind::wheel)
      variance[i] = 2.0 * rounding_variance(chassis.wheels()[static_cast<std::size_t>(row.wheel)]);
  return variance;
}

RowVector noise_of(const Chassis& chassis, const Rows& rows, const Vector3& motion, double duration_s) {
  return readings_of(chassis, rows, predicted(chassis, rows, motion, duration_s)).variance -
         rounding_of(chassis, rows) + misreading_variances(chassis, rows, motion);
}

Vector3 estimated_motion(const Chassis& chassis, const Rows& rows, const Increment& part) {
  const RowVector z = readings_of(chassis, rows, part).z;
  const Vector3 roughly =
      estimate_twist(rows, {z, weighing_variances(chassis, rows, 1.0, 1.0)}).twist.vector();
  const RowVector variance = noise_of(chassis, rows, roughly, part.duration_s);
  if (!(variance.array() > 0.0).all()) return roughly;  // all is exact, as of a robot that stands
  return estimate_twist(rows, {z, variance}).twist.vector();
}

Combinations nearest_null_space(const Combinations& P, const Rows& rows) {
  const Combinations null_space = left_null_space(rows);
  return null_space * (null_space.transpose() * P);
}

Comparison comparison_of(const Chassis& chassis, const Rows& rows, const Chassis& driven,
                         const Rows& driven_rows, const Combinations& P,
                         std::span<const Parameter> parameters) {
  Comparison comparison{chassis, rows, parameters, P, driven, driven_rows, nearest_null_space(P, driven_rows),
                        {}};
  for (const Parameter& parameter : parameters)
    comparison.row_derivatives.push_back(row_derivative(parameter, driven, driven_rows));
  return comparison;
}

Contradiction contradiction_of(const Comparison& comparison, const Increment& sum, const Vector3& motion,
                               const RowVector& variance, bool with_errors) {
  const int n = comparison.rows.measured;
  const auto parameters = static_cast<Eigen::Index>(comparison.parameters.size());
  const auto by_parameters = [&](const Vector3& twist) {
    Eigen::MatrixXd J(comparison.P.cols(), parameters);
    for (std::size_t j = 0; j < comparison.parameters.size(); ++j) {
      const RowVector dz = predicted_derivative(comparison, comparison.parameters[j], twist, sum);
      J.col(static_cast<Eigen::Index>(j)) =
          comparison.driven_P.transpose() * (comparison.row_derivatives[j].topRows(n) * twist - dz.head(n));
    }
    return J;
  };
  Contradiction result{
      comparison.P.transpose() * readings_of(comparison.chassis, comparison.rows, sum).z.head(n),
      combined_covariance(comparison.driven_P, variance),
      by_parameters(motion),
      {}};
  if (!with_errors) return result;
  result.J_errors.setZero(result.J.size(), result.J.size());
  if (!(variance.array() > 0.0).all()) return result;  // as of a robot that stands: the motion is exact
  // J is linear in the motion.
  const Eigen::MatrixXd at_rest = by_parameters(Vector3::Zero());
  Eigen::MatrixX3d by_motion(result.J.size(), 3);
  for (Eigen::Index i = 0; i < 3; ++i)
    by_motion.col(i) = (by_parameters(Vector3::Unit(i)) - at_rest).reshaped();
  const Matrix3 Q =
      (comparison.rows.H.transpose() * variance.cwiseInverse().asDiagonal() * comparison.rows.H).inverse();
  result.J_errors = by_motion * Q * by_motion.transpose();
  return result;
}

}  // namespace trundle::calibration
