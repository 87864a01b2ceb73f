#include "trundle/slip/parity.hpp"

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "trundle/chassis/without_wheel.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"

namespace trundle::slip {
namespace {

// An error of a wheel that moves the residual by less than this share of itself is not checked by any other.
constexpr double kUnchecked = 1e-9;
constexpr double kStillGyro = 4.0;  // sigmas

/// (HᵀH)⁻¹Hᵀ of rows that are weighed alike, turns and the gyro scaled to the size of the robot. Directions
/// that no row sees stay zero.
Eigen::MatrixXd twist_solver(const Rows& rows, double size_m) {
  Eigen::MatrixXd H = rows.H;
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(rows.count());
  for (int i = 0; i < rows.count(); ++i)
    if (rows.row[static_cast<std::size_t>(i)].kind == RowKind::gyro) weight[i] = size_m;
  H = weight.asDiagonal() * H;
  H.col(2) /= size_m;
  Eigen::MatrixXd solver = pseudo_inverse(H) * weight.asDiagonal();
  solver.row(2) /= size_m;
  return solver;
}

Rows checked_rows(const Robot& robot) {
  if (robot.chassis.wheel_count == 0)
    throw CannotAnswer(
        fmt::format("robot '{}' has no wheels: which of them slips cannot be told", robot.name));
  const std::optional<Chassis> chassis = without_steering(robot.chassis);
  if (!chassis)
    throw CannotAnswer(fmt::format("robot '{}': slip of steered wheels is not looked for", robot.name));
  Rows rows = rows_of(*chassis, true);
  if (observability(rows).degrees_of_freedom == 0)
    throw CannotAnswer(
        fmt::format("robot '{}': slip is not observable: no redundant measurement; a gyro or another "
                    "wheel would be one",
                    robot.name));
  return rows;
}

/// By how much more or less than the robot file says clean residuals scatter, over all of them.
double typical_scale(const ParityMatrix& scale) {
  return scale.norm() / std::sqrt(static_cast<double>(scale.rows()));
}

}  // namespace

bool can_show_slip(const Chassis& chassis, bool with_gyro) {
  const std::optional<Chassis> fixed = without_steering(chassis);
  return fixed && observability(rows_of(*fixed, with_gyro)).degrees_of_freedom > 0;
}

Parity::Parity(const Robot& robot)
    : chassis_(robot.chassis), rows_(checked_rows(robot)), combinations_(left_null_space(rows_)) {
  const double lever = rows_.H.col(2).cwiseAbs().maxCoeff();
  size_ = {1.0, 1.0, lever > 0.0 ? lever : 1.0};
  twist_from_readings_ = twist_solver(rows_, size_[2]);
  if (chassis_.gyro) gyro_scale_ = chassis_.gyro->scale;
}

Parity::Raw Parity::raw(const JudgedInterval& interval, double timing_sigma_s) const {
  const Increment& increment = interval.readings;
  const GyroBias& bias = interval.bias;
  Raw raw;
  raw.readings = readings_of(chassis_, rows_, increment);
  Readings& readings = raw.readings;
  if (chassis_.gyro) {
    const double bias_turn = gyro_scale_ * increment.duration_s;
    readings.z[rows_.measured - 1] += (chassis_.gyro->bias_rad_s - bias.rad_s) * bias_turn;
    readings.variance[rows_.measured - 1] += bias.variance * bias_turn * bias_turn;
    const double jitter = timing_sigma_s * interval.turn_rate_change_rad_s;
    readings.variance[rows_.measured - 1] += jitter * jitter;
  }
  const auto measured = readings.z.head(rows_.measured);
  raw.y = combinations_.transpose() * measured;
  raw.covariance = combined_covariance(combinations_, readings.variance);
  raw.twist = twist_from_readings_ * readings.z;
  return raw;
}

Contradiction Parity::contradiction(const JudgedInterval& interval, const ResidualModel* model) const {
  const Raw raw = this->raw(interval, model ? model->timing_sigma_s : 0.0);
  const Eigen::LLT<ParityMatrix> cholesky(raw.covariance);
  const auto whiten = [&](auto&& x) {
    cholesky.matrixL().solveInPlace(x);
    if (model) model->scale.triangularView<Eigen::Lower>().solveInPlace(x);
  };
  Contradiction result;
  result.e = raw.y;
  if (model) result.e -= model->by_motion * raw.twist;
  whiten(result.e);
  result.chi2 = result.e.squaredNorm();
  result.towards = combinations_.topRows(chassis_.wheel_count).transpose();
  whiten(result.towards);
  ParityVector by_bias = ParityVector::Zero(result.e.size());
  if (chassis_.gyro) {
    by_bias = combinations_.row(rows_.measured - 1).transpose() *
              (std::sqrt(interval.bias.variance) * gyro_scale_ * interval.readings.duration_s);
    whiten(by_bias);
    result.gyro_rad = raw.readings.z[rows_.measured - 1];
    result.gyro_sigma_rad = std::sqrt(raw.readings.variance[rows_.measured - 1]);
  }
  const double noise_scale = model ? typical_scale(model->scale) : 1.0;
  for (std::size_t i = 0; i < wheels(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    result.travel[i] = raw.readings.z[column];
    result.travel_sigma[i] = noise_scale * std::sqrt(raw.readings.variance[column]);
    const double length = result.towards.col(column).norm();
    if (length * result.travel_sigma[i] < kUnchecked) continue;
    result.towards.col(column) /= length;
    result.score[i] = result.towards.col(column).dot(result.e);
    result.excess_m[i] = result.score[i] / length;
    result.excess_sigma_m[i] = 1.0 / length;
    result.drift[i] = std::abs(result.towards.col(column).dot(by_bias));
  }
  return result;
}

bool Parity::is_stuck(const Contradiction& c) const {
  const Rows& rows = rows_;
  RowMatrix still(0, 3);
  int turning = 0;
  const auto keep = [&](int row) {
    still.conservativeResize(still.rows() + 1, 3);
    still.row(still.rows() - 1) = rows.H.row(row);
  };
  for (std::size_t i = 0; i < wheels(); ++i) {
    if (c.travel[i] == 0.0)
      keep(static_cast<int>(i));
    else
      ++turning;
  }
  if (uses_gyro() && std::abs(c.gyro_rad) < kStillGyro * c.gyro_sigma_rad) keep(rows.measured - 1);
  if (turning < 2 || still.rows() == 0) return false;
  return rank_of(still) == rank_of(rows.H.topRows(rows.measured));
}

}  // namespace trundle::slip
