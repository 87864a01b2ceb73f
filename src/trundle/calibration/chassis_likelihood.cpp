#include "trundle/calibration/chassis_likelihood.hpp"

#include <Eigen/QR>

namespace trundle {
namespace {

constexpr double kRankLimit = 1e-9;

/// Readings of a window of intervals, summed.
struct Window {
  Increment sum;
  Readings readings;
};

bool usable(const Increment& increment, bool with_gyro) {
  return increment.has_gyro || !with_gyro;
}

void extend(Window& window, const Increment& increment, const Readings& readings) {
  if (window.readings.z.size() == 0) {
    window.readings = {RowVector::Zero(readings.z.size()), RowVector::Zero(readings.z.size())};
  }
  window.sum.duration_s += increment.duration_s;
  window.sum.gyro_rad += increment.gyro_rad;
  window.sum.gyro_change_rad_s += increment.gyro_change_rad_s;
  for (std::size_t i = 0; i < window.sum.turned.size(); ++i) window.sum.turned[i] += increment.turned[i];
  window.readings.z += readings.z;
  window.readings.variance += readings.variance;
}

/// A wheel's reading and its noise grow alike with its diameter; the variance of readings_of() grows only as
/// fast as the travel. The rest of the factor, for each measured row.
RowVector noise_scale(const Rows& rows, const Chassis& chassis, const Chassis& nominal) {
  RowVector scale = RowVector::Ones(rows.count());
  for (int i = 0; i < rows.measured; ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (row.kind != RowKind::wheel) continue;
    const auto wheel = static_cast<std::size_t>(row.wheel);
    scale[i] = std::abs(chassis.wheels()[wheel].diameter_m / nominal.wheels()[wheel].diameter_m);
  }
  return scale;
}

/// All that is the same for every window.
struct Context {
  const Chassis& chassis;
  const Rows& rows;
  std::span<const Parameter> parameters;
  std::vector<RowMatrix> row_derivatives;
  RowVector variance_scale;
  double gate;
};

/// ∂(z / σ)/∂p · σ with z as the motion predicts it: a diameter scales reading and noise alike.
RowVector predicted_derivative(const Context& context, const Parameter& parameter, const RowVector& predicted,
                               const Increment& sum) {
  if (parameter.kind == ParameterKind::gyro_bias || parameter.kind == ParameterKind::gyro_time_offset)
    return reading_derivative(parameter, context.chassis, context.rows, sum);
  RowVector derivative = RowVector::Zero(predicted.size());
  for (int i = 0; i < context.rows.measured; ++i) {
    const Row& row = context.rows.row[static_cast<std::size_t>(i)];
    if (parameter.kind == ParameterKind::diameter && row.kind == RowKind::wheel &&
        row.wheel == parameter.wheel)
      derivative[i] = predicted[i] / context.chassis.wheels()[static_cast<std::size_t>(row.wheel)].diameter_m;
    if (parameter.kind == ParameterKind::gyro_scale && row.kind == RowKind::gyro)
      derivative[i] = predicted[i] / context.chassis.gyro->scale;
  }
  return derivative;
}

/// The projection of whitened measured readings on what no motion can produce, and its derivatives.
void add_window(const Window& window, const Context& context, Information& information) {
  const int n = context.rows.measured;
  const Eigen::VectorXd variance = window.readings.variance.cwiseProduct(context.variance_scale).head(n);
  const Eigen::VectorXd whitening = variance.cwiseSqrt().cwiseInverse();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(whitening.asDiagonal() * context.rows.H.topRows(n));
  qr.setThreshold(kRankLimit);
  const Eigen::Index dof = n - qr.rank();
  if (dof == 0) return;
  const Eigen::MatrixXd Q = qr.householderQ();
  const Eigen::MatrixXd N = Q.rightCols(dof).transpose() * whitening.asDiagonal();
  const Eigen::VectorXd residual = N * window.readings.z.head(n);
  const Vector3 twist = qr.solve(whitening.cwiseProduct(window.readings.z.head(n)));
  const RowVector predicted = context.rows.H * twist;
  Eigen::MatrixXd J(dof, static_cast<Eigen::Index>(context.parameters.size()));
  for (std::size_t j = 0; j < context.parameters.size(); ++j) {
    const RowVector dz = predicted_derivative(context, context.parameters[j], predicted, window.sum);
    J.col(static_cast<Eigen::Index>(j)) = N * (context.row_derivatives[j].topRows(n) * twist - dz.head(n));
  }
  add_within(information, J, Eigen::MatrixXd::Identity(dof, dof), residual, context.gate);
}

}  // namespace

std::vector<Information> chassis_likelihood(const Run& run, const Robot& robot, const Robot& nominal,
                                            std::span<const Parameter> parameters,
                                            const ChassisLikelihoodOptions& options) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  std::vector<Information> result(static_cast<std::size_t>(options.pieces), Information::zero(n));
  const bool with_gyro = robot.chassis.gyro.has_value();
  const Rows rows = rows_of(robot.chassis, with_gyro);
  if (observability(rows).degrees_of_freedom == 0) return result;
  Context context{robot.chassis, rows, parameters, {}, noise_scale(rows, robot.chassis, nominal.chassis),
                  options.gate};
  context.variance_scale *= options.variance_factor;
  for (const Parameter& parameter : parameters)
    context.row_derivatives.push_back(row_derivative(parameter, robot.chassis, rows));
  Window window;
  const auto& increments = run.readings.increments;
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const bool broken = run.readings.bridged[i] || !usable(increments[i], with_gyro);
    if (!broken) extend(window, increments[i], readings_of(robot.chassis, rows, increments[i]));
    if (!broken && window.sum.duration_s < options.window_s - 1e-9) continue;
    if (window.sum.duration_s >= 0.5 * options.window_s)
      add_window(window, context, result[i * result.size() / increments.size()]);
    window = {};
  }
  return result;
}

}  // namespace trundle
