#include "trundle/odometry/motion_model.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include <Eigen/LU>

namespace trundle {
namespace {

using Triple = std::array<double, 3>;

/// The increment whose only reading is input k, of size one.
Increment unit_increment(std::size_t k, std::size_t wheels) {
  Increment increment{.has_gyro = true};
  if (k < wheels) increment.turned[k] = 1.0;
  if (k == wheels) increment.gyro_rad = 1.0;
  if (k == wheels + 1) increment.duration_s = 1.0;
  return increment;
}

double dot(const Triple& a, const Triple& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

void add(Triple& sum, double factor, const Triple& v) {
  for (std::size_t i = 0; i < 3; ++i) sum[i] += factor * v[i];
}

/// sum += factor · v vᵀ
void add_outer(Symmetric3& sum, double factor, const Triple& v) {
  const double x = factor * v[0];
  const double y = factor * v[1];
  sum[0] += x * v[0];
  sum[1] += x * v[1];
  sum[2] += x * v[2];
  sum[3] += y * v[1];
  sum[4] += y * v[2];
  sum[5] += factor * v[2] * v[2];
}

/// N = L D Lᵀ without pivoting: N is positive definite, and this does not mind rows of very different weight.
struct Cholesky {
  double l10, l20, l21, d0, d1, d2;

  explicit Cholesky(const Symmetric3& n) {
    d0 = 1.0 / n[0];
    l10 = n[1] * d0;
    l20 = n[2] * d0;
    d1 = 1.0 / (n[3] - l10 * n[1]);
    const double u12 = n[4] - l10 * n[2];
    l21 = u12 * d1;
    d2 = 1.0 / (n[5] - l20 * n[2] - l21 * u12);
  }
  Triple solve(const Triple& b) const {
    const double y1 = b[1] - l10 * b[0];
    const double y2 = b[2] - l20 * b[0] - l21 * y1;
    const double x2 = y2 * d2;
    const double x1 = y1 * d1 - l21 * x2;
    return {b[0] * d0 - l10 * x1 - l20 * x2, x1, x2};
  }
  Symmetric3 inverse() const {
    const Triple a = solve({1.0, 0.0, 0.0});
    const Triple b = solve({0.0, 1.0, 0.0});
    return {a[0], a[1], a[2], b[1], b[2], d2};
  }
};

}  // namespace

Matrix3 full_matrix(const Symmetric3& s) {
  return (Matrix3() << s[0], s[1], s[2], s[1], s[3], s[4], s[2], s[4], s[5]).finished();
}

Symmetric3 symmetric_of(const Matrix3& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)};
}

/// The normal equations of one interval.
struct MotionModel::Weighted {
  std::array<double, kMaxRows> z;
  std::array<double, kMaxRows> weight;
  Symmetric3 normal;  ///< HᵀWH
  Triple right;       ///< HᵀWz
};

MotionModel::MotionModel(const Chassis& chassis, std::span<const Parameter> parameters, bool with_gyro)
    : parameters_(parameters.size()),
      wheels_(chassis.wheel_count > 0 ? chassis.wheels().size() : 2),
      with_gyro_(with_gyro && chassis.gyro.has_value()) {
  assert(parameters.size() <= kMaxModelParameters);
  const Rows rows = rows_of(chassis, with_gyro_);
  rows_ = static_cast<std::size_t>(rows.count());
  inputs_ = wheels_ + (with_gyro_ ? 2 : 0);
  square_ = rows_ == 3;
  for (std::size_t i = 0; i < rows_; ++i) Eigen::Map<Vector3>(h_[i].data()) = rows.H.row(static_cast<int>(i));
  probe_readings(chassis, rows);
  probe_derivatives(chassis, rows, parameters);
  if (square_) linearise();
}

/// z is linear in u and its variance in |u|, so unit inputs show the coefficients of both.
void MotionModel::probe_readings(const Chassis& chassis, const Rows& rows) {
  const Readings at_rest = readings_of(chassis, rows, Increment{.has_gyro = true});
  std::ranges::copy(at_rest.variance, variance_at_rest_.begin());
  for (std::size_t k = 0; k < inputs_; ++k) {
    const Readings unit = readings_of(chassis, rows, unit_increment(k, wheels_));
    for (std::size_t i = 0; i < rows_; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      reading_[i][k] = unit.z[row];
      variance_[i][k] = unit.variance[row] - at_rest.variance[row];
    }
  }
}

void MotionModel::probe_derivatives(const Chassis& chassis, const Rows& rows,
                                    std::span<const Parameter> parameters) {
  for (std::size_t j = 0; j < parameters_; ++j) {
    const RowMatrix dH = row_derivative(parameters[j], chassis, rows);
    for (int i = 0; i < dH.rows(); ++i)
      if (!dH.row(i).isZero(0.0))
        row_changes_.push_back({j, static_cast<std::size_t>(i), {dH(i, 0), dH(i, 1), dH(i, 2)}});
    for (std::size_t k = 0; k < inputs_; ++k) {
      const RowVector dz = reading_derivative(parameters[j], chassis, rows, unit_increment(k, wheels_));
      for (int i = 0; i < dz.size(); ++i)
        if (dz[i] != 0.0) reading_changes_.push_back({j, static_cast<std::size_t>(i), k, dz[i]});
    }
    if (with_gyro_ && parameters[j].kind == ParameterKind::gyro_time_offset)
      clock_ = Clock{j, static_cast<std::size_t>(rows.measured - 1), chassis.gyro->scale};
  }
}

void MotionModel::linearise() {
  Matrix3 H;
  InputMatrix Z(3, inputs_);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    H.row(row) = Eigen::Map<const Vector3>(h_[i].data());
    Z.row(row) = Eigen::Map<const Eigen::RowVectorXd>(reading_[i].data(), Z.cols());
  }
  const Matrix3 M = H.inverse();
  linearised_.twist = M * Z;
  linearised_.derivative.assign(parameters_, InputMatrix::Zero(3, Z.cols()));
  for (const ReadingChange& change : reading_changes_)
    linearised_.derivative[change.parameter].col(static_cast<Eigen::Index>(change.input)) +=
        change.dz * M.col(static_cast<Eigen::Index>(change.row));
  for (const RowChange& change : row_changes_)
    linearised_.derivative[change.parameter] -=
        M.col(static_cast<Eigen::Index>(change.row)) *
        (Eigen::Map<const Vector3>(change.dh.data()).transpose() * linearised_.twist);
  for (std::size_t k = 0; k < inputs_; ++k)
    Eigen::Map<Vector3>(columns_[k < wheels_ ? k : kMaxWheels + (k - wheels_)].data()) =
        linearised_.twist.col(static_cast<Eigen::Index>(k));
  linearise_noise(M);
}

/// M W⁻¹ Mᵀ is linear in |u| because W⁻¹ is.
void MotionModel::linearise_noise(const Matrix3& M) {
  for (std::size_t i = 0; i < 3; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const Triple m = by_row_[i] = {M(0, row), M(1, row), M(2, row)};
    add_outer(noise_at_rest_, variance_at_rest_[i], m);
    for (std::size_t k = 0; k < inputs_; ++k) add_outer(noise_[k], variance_[i][k], m);
  }
}

void MotionModel::read_inputs(const Increment& increment, Inputs& u) const {
  for (std::size_t k = 0; k < wheels_; ++k) u[k] = increment.turned[k];
  if (!with_gyro_) return;
  u[wheels_] = increment.gyro_rad;
  u[wheels_ + 1] = increment.duration_s;
}

void MotionModel::weigh(const Inputs& u, const Increment& increment, Weighted& equations) const {
  equations.normal = {};
  equations.right = {};
  for (std::size_t i = 0; i < rows_; ++i) {
    double z = 0.0;
    double variance = variance_at_rest_[i] + (i < wheels_ ? increment.slip_variance[i] : 0.0);
    for (std::size_t k = 0; k < inputs_; ++k) {
      z += reading_[i][k] * u[k];
      variance += variance_[i][k] * std::abs(u[k]);
    }
    equations.z[i] = z;
    equations.weight[i] = 1.0 / variance;
    add_outer(equations.normal, equations.weight[i], h_[i]);
    add(equations.right, equations.weight[i] * z, h_[i]);
  }
}

Triple MotionModel::weighted_twist(const Increment& increment) const {
  Inputs u;
  read_inputs(increment, u);
  Weighted equations;
  weigh(u, increment, equations);
  return Cholesky(equations.normal).solve(equations.right);
}

void MotionModel::twist_with_covariance(const Increment& increment, TwistStep& step) const {
  Inputs u;
  read_inputs(increment, u);
  if (square_) {
    step.twist = twist(increment);
    square_step(u, increment, step);
  } else {
    weighted_step(u, increment, step);
  }
}

Triple MotionModel::response_to_turn(const Increment& increment, double gyro_scale) const {
  // The twist is affine in the gyro's integral: the weights do not depend on it.
  Increment more = increment;
  more.gyro_rad += 1.0 / gyro_scale;
  const Triple before = twist(increment);
  const Triple after = twist(more);
  return {after[0] - before[0], after[1] - before[1], after[2] - before[2]};
}

void MotionModel::square_step(const Inputs& u, const Increment& increment, TwistStep& step) const {
  step.covariance = noise_at_rest_;
  for (std::size_t i = 0; i < wheels_; ++i)
    if (const double slip = increment.slip_variance[i]; slip > 0.0)
      add_outer(step.covariance, slip, by_row_[i]);
  for (std::size_t k = 0; k < inputs_; ++k)
    for (std::size_t i = 0; i < 6; ++i) step.covariance[i] += std::abs(u[k]) * noise_[k][i];
  for (std::size_t j = 0; j < parameters_; ++j) {
    const double* column = linearised_.derivative[j].data();
    Triple derivative{};
    for (std::size_t k = 0; k < inputs_; ++k, column += 3)
      for (std::size_t i = 0; i < 3; ++i) derivative[i] += column[i] * u[k];
    step.derivative[j] = derivative;
  }
  if (clock_) add(step.derivative[clock_->parameter], -increment.gyro_change_rad_s, columns_[kMaxWheels]);
}

/// ∂ξ/∂p = N⁻¹ (∂Hᵀ W r + Hᵀ W (∂z − ∂H ξ)), W held. docs/odometry.md, eq. 5.
void MotionModel::weighted_step(const Inputs& u, const Increment& increment, TwistStep& step) const {
  Weighted equations;
  weigh(u, increment, equations);
  const Cholesky normal(equations.normal);
  step.twist = normal.solve(equations.right);
  step.covariance = normal.inverse();
  const auto derivatives = std::span(step.derivative).first(parameters_);
  std::ranges::fill(derivatives, Triple{});
  for (const RowChange& change : row_changes_) {
    const double weight = equations.weight[change.row];
    const double residual = equations.z[change.row] - dot(h_[change.row], step.twist);
    add(derivatives[change.parameter], weight * residual, change.dh);
    add(derivatives[change.parameter], -weight * dot(change.dh, step.twist), h_[change.row]);
  }
  for (const ReadingChange& change : reading_changes_)
    add(derivatives[change.parameter], equations.weight[change.row] * change.dz * u[change.input],
        h_[change.row]);
  if (clock_)
    add(derivatives[clock_->parameter],
        -equations.weight[clock_->row] * clock_->scale * increment.gyro_change_rad_s, h_[clock_->row]);
  for (Triple& derivative : derivatives) derivative = normal.solve(derivative);
}

}  // namespace trundle
