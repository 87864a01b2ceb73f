#include "trundle/calibration/chassis_likelihood.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/chassis/contact.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

/// Readings of a window of intervals, summed, and the variances of their noise.
struct Window {
  Increment sum;
  RowVector variance;
};

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

/// Of the difference of two counts: it is that of the whole window, for in between it cancels.
RowVector rounding_of(const Chassis& chassis, const Rows& rows) {
  RowVector variance = RowVector::Zero(rows.count());
  for (int i = 0; i < rows.measured; ++i)
    if (const Row& row = rows.row[static_cast<std::size_t>(i)]; row.kind == RowKind::wheel)
      variance[i] = 2.0 * rounding_variance(chassis.wheels()[static_cast<std::size_t>(row.wheel)]);
  return variance;
}

/// Of a part of a window, without rounding. The noise is that of the motion estimated from all readings, not
/// of each reading itself: the error of a weighted estimate is independent of what no motion explains, that
/// of a reading is not, and a weight that depends on the residual biases its mean.
RowVector noise_of(const Chassis& chassis, const Rows& rows, const Increment& part) {
  const Vector3 motion = twist_of(chassis, rows, part).vector();
  return readings_of(chassis, rows, predicted(chassis, rows, motion, part.duration_s)).variance -
         rounding_of(chassis, rows);
}

/// What a window of readings is compared by: the same for all where no wheel is steered.
struct Context {
  const Chassis& chassis;
  const Rows& rows;
  std::span<const Parameter> parameters;
  Combinations P;
  const Chassis& driven;    ///< as it moved, by which derivatives are taken: at_estimated_angles()
  const Rows& driven_rows;  ///< of it
  Eigen::MatrixXd driven_P;
  std::vector<RowMatrix> row_derivatives;
  double variance_factor;
  double gate;
};

/// ∂(z / σ)/∂p · σ with z as the motion predicts it: a diameter scales reading and noise alike.
RowVector predicted_derivative(const Context& context, const Parameter& parameter, const Vector3& twist,
                               const Increment& sum) {
  const Rows& rows = context.driven_rows;
  if (is_of_velocity(parameter.kind))
    return reading_derivative(parameter, context.driven, rows,
                              predicted(context.driven, rows, twist, sum.duration_s));
  if (parameter.kind == ParameterKind::gyro_bias || parameter.kind == ParameterKind::gyro_time_offset)
    return reading_derivative(parameter, context.driven, rows, sum);
  return reading_growth(parameter, context.driven, rows).cwiseProduct(rows.H * twist);
}

/// y = Pᵀz, of covariance S = Pᵀ V P, and its derivatives: docs/theory/calibration.md, eq. 7.
void add_window(const Window& window, const Context& context, Information& information) {
  const int n = context.rows.measured;
  const RowVector z = readings_of(context.chassis, context.rows, window.sum).z;
  const RowVector variance = context.variance_factor * window.variance;
  const Vector3 twist = estimate_twist(context.rows, {z, variance}).twist.vector();
  const Eigen::MatrixXd P = context.P;
  const Eigen::MatrixXd S = combined_covariance(context.P, variance);
  Eigen::MatrixXd J(P.cols(), static_cast<Eigen::Index>(context.parameters.size()));
  for (std::size_t j = 0; j < context.parameters.size(); ++j) {
    const RowVector dz = predicted_derivative(context, context.parameters[j], twist, window.sum);
    J.col(static_cast<Eigen::Index>(j)) =
        context.driven_P.transpose() * (context.row_derivatives[j].topRows(n) * twist - dz.head(n));
  }
  add_within(information, J, inverse_of(S), P.transpose() * z.head(n), context.gate);
}

/// `driven`, of `driven_rows`: the chassis as it moved; where no wheel is steered, the same.
Context context_of(const Chassis& chassis, const Rows& rows, const Chassis& driven, const Rows& driven_rows,
                   std::span<const Parameter> parameters, const ChassisLikelihoodOptions& options) {
  Context context{chassis,     rows, parameters, left_null_space(rows),   driven,
                  driven_rows, {},   {},         options.variance_factor, options.gate};
  const Eigen::MatrixXd null_space = left_null_space(driven_rows);
  context.driven_P = null_space * (null_space.transpose() * context.P);  // the nearest to P
  for (const Parameter& parameter : parameters)
    context.row_derivatives.push_back(row_derivative(parameter, driven, driven_rows));
  return context;
}

void add_steering_noise(const Chassis& standing, const Rows& rows, Window& window) {
  const Vector3 motion = twist_of(standing, rows, window.sum).vector();
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (row.kind != RowKind::lateral) continue;
    const Wheel& wheel = standing.all_wheels()[static_cast<std::size_t>(row.wheel)];
    if (wheel.steering) window.variance[i] += misreading_variance(wheel, rolling_row(wheel).dot(motion));
  }
}

/// With its wheels at the angles at which the motion by all readings has them. Derivatives at what was read
/// go with the very error that y is made of: of a tricycle's wheelbase and steering scale together they were
/// nothing else, and made them zero. docs/theory/calibration.md, eq. 7a.
Chassis at_estimated_angles(Chassis standing, const Rows& rows, const Window& window) {
  const RowVector z = readings_of(standing, rows, window.sum).z;
  const Vector3 motion = estimate_twist(rows, {z, window.variance}).twist.vector();
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

/// One interval of steered wheels, whose rows contradict each other in another way at every angle. That a
/// wheel does not skid is a reading here: of its angle.
void add_steered(const Increment& increment, const Chassis& chassis, std::span<const Parameter> parameters,
                 const ChassisLikelihoodOptions& options, Information& information) {
  const Chassis standing = at_steering(chassis, increment);
  Rows rows = rows_of(standing, chassis.gyro.has_value());
  if (rows_at(chassis, increment, chassis.gyro.has_value()).count() > rows.count()) return;  // not all seen
  rows.measured = rows.count();
  Window window{increment, rounding_of(standing, rows)};
  window.variance += noise_of(standing, rows, increment);
  add_steering_noise(standing, rows, window);
  const Chassis driven = at_estimated_angles(standing, rows, window);
  Rows driven_rows = rows_of(driven, chassis.gyro.has_value());
  if (driven_rows.count() != rows.count()) return;
  driven_rows.measured = rows.measured;
  add_window(window, context_of(standing, rows, driven, driven_rows, parameters, options), information);
}

std::vector<Information> steered_likelihood(const Run& run, const Chassis& chassis,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  std::vector<Information> result(static_cast<std::size_t>(options.blocks), Information::zero(n));
  const bool with_gyro = chassis.gyro.has_value();
  if (rows_of(chassis, with_gyro).count() <= 3) return result;
  const auto& increments = run.readings.increments;
  for (std::size_t i = 0; i < increments.size(); ++i)
    if (!run.readings.bridged[i] && (increments[i].has_gyro || !with_gyro) && any_turns(increments[i]))
      add_steered(increments[i], chassis, parameters, options, result[i * result.size() / increments.size()]);
  return result;
}

}  // namespace

std::vector<Information> chassis_likelihood(const Run& run, const Robot& robot,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options) {
  const Chassis& chassis = robot.chassis;
  if (is_steered(chassis)) return steered_likelihood(run, chassis, parameters, options);
  const auto n = static_cast<Eigen::Index>(parameters.size());
  std::vector<Information> result(static_cast<std::size_t>(options.blocks), Information::zero(n));
  const std::optional<WindowSums> own =
      options.sums ? std::nullopt : window_sums(run, chassis, options.window_s);
  const WindowSums* sums = options.sums ? options.sums : own ? &*own : nullptr;
  if (!sums) return result;
  const Rows rows = rows_of(chassis, chassis.gyro.has_value());
  const Context context = context_of(chassis, rows, chassis, rows, parameters, options);
  const RowVector rounding = rounding_of(chassis, rows);
  std::size_t part = 0;
  for (std::size_t i = 0; i < sums->windows.size(); ++i) {
    Window window{sums->windows[i], rounding};
    for (; part < sums->parts_end[i]; ++part) window.variance += noise_of(chassis, rows, sums->parts[part]);
    add_window(window, context, result[sums->last[i] * result.size() / sums->increments]);
  }
  return result;
}

}  // namespace trundle::calibration
