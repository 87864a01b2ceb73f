#include "trundle/odometry/motion_model.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"

namespace trundle::odometry {
namespace {

/// The increment whose only reading is input k, of size one.
Increment unit_increment(std::size_t k, std::size_t wheels) {
  Increment increment{.has_gyro = true};
  if (k < wheels) increment.turned[k] = 1.0;
  if (k == wheels) increment.gyro_rad = 1.0;
  if (k == wheels + 1) increment.duration_s = 1.0;
  if (k == wheels + 2) increment.scrub_turned = 1.0;
  if (k > wheels + 2) increment.speed_turned[k - (wheels + 3)] = 1.0;
  return increment;
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

double input_of(const Increment& increment, std::size_t input, std::size_t wheels) {
  if (input < wheels) return increment.turned[input];
  if (input == wheels + 2) return increment.scrub_turned;
  if (input > wheels + 2) return increment.speed_turned[input - (wheels + 3)];
  return input == wheels ? increment.gyro_rad : increment.duration_s;
}

Triple product(const Symmetric3& s, const Triple& v) {
  return {s[0] * v[0] + s[1] * v[1] + s[2] * v[2], s[1] * v[0] + s[3] * v[1] + s[4] * v[2],
          s[2] * v[0] + s[4] * v[1] + s[5] * v[2]};
}

}  // namespace

MotionModel::MotionModel(const Chassis& chassis, std::span<const Parameter> parameters, bool with_gyro)
    : parameters_(parameters.size()),
      wheels_(chassis.wheel_count > 0 ? chassis.wheels().size() : 2),
      with_gyro_(with_gyro && chassis.gyro.has_value()),
      with_duration_(with_gyro_ || chassis.wheel_count == 0),
      scrubs_(can_scrub(chassis) && (chassis.scrub != 0.0 || contains(parameters, ParameterKind::scrub))),
      grows_(grows(chassis) ||
             (chassis.wheel_count > 0 && contains(parameters, ParameterKind::tyre_growth))) {
  assert(parameters.size() <= kMaxModelParameters);
  if (is_steered(chassis)) {
    steered_.emplace(chassis, parameters, with_gyro_);
    return;
  }
  const Rows rows = rows_of(chassis, with_gyro_);
  rows_ = static_cast<std::size_t>(rows.count());
  inputs_ = wheels_ + (grows_ ? 3 + wheels_ : scrubs_ ? 3 : with_duration_ ? 2 : 0);
  square_ = rows_ == 3;
  for (std::size_t i = 0; i < rows_; ++i) Eigen::Map<Vector3>(h_[i].data()) = rows.H.row(static_cast<int>(i));
  probe_readings(chassis, rows);
  probe_derivatives(chassis, rows, parameters);
  const RollingGauge gauge(chassis);
  for (std::size_t octave = 0; octave < kOctaves; ++octave) {
    const RowVector per_second = weighing_variances(chassis, rows, gauge.octave_speed(octave), 1.0);
    std::ranges::copy(per_second, weighing_.emplace_back().begin());
  }
  const std::size_t gains = square_ || !with_gyro_ ? 1 : kOctaves;
  for (std::size_t octave = 0; octave < gains; ++octave) gains_.push_back(gain_of(weighing_[octave]));
}

/// z is linear in u and its variance in |u|, so unit inputs show the coefficients of both. The rounding of
/// counts is no part of it: it does not add up, and whoever adds up intervals carries it along.
void MotionModel::probe_readings(const Chassis& chassis, const Rows& rows) {
  const Readings at_rest = readings_of(chassis, rows, Increment{.has_gyro = true});
  std::ranges::copy(at_rest.variance, variance_at_rest_.begin());
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    variance_at_rest_[i] -= 2.0 * rounding_variance(chassis.wheels()[i]);
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

/// G = N⁻¹ Hᵀ W, N = Hᵀ W H.
MotionModel::Gain MotionModel::gain_of(const std::array<double, kMaxRows>& variance) const {
  Gain gain;
  Symmetric3 normal{};
  for (std::size_t i = 0; i < rows_; ++i) {
    gain.weight[i] = 1.0 / variance[i];
    add_outer(normal, gain.weight[i], h_[i]);
  }
  const Cholesky cholesky(normal);
  gain.inverse_normal = cholesky.inverse();
  for (std::size_t i = 0; i < rows_; ++i) {
    Triple& column = gain.by_row[i] = cholesky.solve(h_[i]);
    for (double& entry : column) entry *= gain.weight[i];
    if (i < wheels_) {
      gain.by_travel.x[i] = column[0];
      gain.by_travel.y[i] = column[1];
      gain.by_travel.h[i] = column[2];
    }
    add_outer(gain.floor, variance_at_rest_[i], column);
    for (std::size_t k = 0; k < inputs_; ++k) {
      add_scaled(gain.by_input[column_of(k)], reading_[i][k], column);
      add_outer(gain.noise[column_of(k)], variance_[i][k], column);
    }
  }
  return gain;
}

/// Where a wheel slips, its reading counts for less in this interval.
MotionModel::Gain MotionModel::gain_for(const Increment& increment, std::size_t octave) const {
  std::array<double, kMaxRows> variance = weighing_[octave];
  for (std::size_t i = 0; i < rows_; ++i)
    variance[i] = variance[i] * increment.duration_s + variance_at_rest_[i];
  for (std::size_t i = 0; i < wheels_; ++i) variance[i] += increment.slip_variance[i];
  return gain_of(variance);
}

Triple MotionModel::twist_of_its_own(const Increment& increment, std::size_t octave) const {
  if (steered_) return steered_->twist(increment, octave);
  return twist_by(gain_for(increment, octave), increment);
}

void MotionModel::step_of_its_own(const Increment& increment, const Rolled& rolled, std::size_t octave,
                                  TwistStep& step) const {
  if (steered_) return steered_->twist_with_covariance(increment, rolled, octave, step);
  step_by(gain_for(increment, octave), increment, rolled, step);
}

LinearisedChassis MotionModel::linearised() const {
  assert(has_one_gain() && !grows_);
  const Gain& gain = gains_.front();
  const auto columns = static_cast<Eigen::Index>(inputs_);
  const auto vector = [](const Triple& t) { return Eigen::Map<const Vector3>(t.data()); };
  LinearisedChassis result{InputMatrix(3, columns), {}};
  for (std::size_t k = 0; k < inputs_; ++k)
    result.twist.col(static_cast<Eigen::Index>(k)) = vector(gain.by_input[column_of(k)]);
  result.derivative.assign(parameters_, InputMatrix::Zero(3, columns));
  for (const ReadingChange& change : reading_changes_)
    result.derivative[change.parameter].col(static_cast<Eigen::Index>(change.input)) +=
        change.dz * vector(gain.by_row[change.row]);
  for (const RowChange& change : row_changes_)
    result.derivative[change.parameter] -=
        vector(gain.by_row[change.row]) * (vector(change.dh).transpose() * result.twist);
  return result;
}

Triple MotionModel::response_to_turn(const Increment& increment, std::size_t octave) const {
  if (steered_) return steered_->response_to_turn(increment, octave);
  const std::size_t gyro_row = wheels_;
  if (is_of_its_own(increment)) return gain_for(increment, octave).by_row[gyro_row];
  return gain_at(octave).by_row[gyro_row];
}

/// Covariance G V Gᵀ with the variances V of the interval, whatever G was weighed by.
void MotionModel::step_by(const Gain& gain, const Increment& increment, const Rolled& rolled,
                          TwistStep& step) const {
  step.twist = twist_by(gain, increment);
  step.covariance = gain.floor;
  const auto add_noise = [&](double factor, const Symmetric3& noise) {
    for (std::size_t i = 0; i < 6; ++i) step.covariance[i] += factor * noise[i];
  };
  for (std::size_t k = 0; k < wheels_; ++k) {
    add_noise(rolled[k], gain.noise[k]);
    if (const double slip = increment.slip_variance[k]; slip > 0.0)
      add_outer(step.covariance, slip, gain.by_row[k]);
  }
  if (with_gyro_) add_noise(increment.duration_s, gain.noise[kMaxWheels + 1]);
  for (std::size_t k = 0; k < wheels_; k += 2)  // in pairs, as they are carried
    for (const std::size_t i : {k, k + 1}) {
      step.by_travel.x[i] = gain.by_travel.x[i];
      step.by_travel.y[i] = gain.by_travel.y[i];
      step.by_travel.h[i] = gain.by_travel.h[i];
    }
  if (parameters_ > 0) derive(gain, increment, step);
}

/// ∂ξ/∂p = G (∂z − ∂H ξ) + N⁻¹ ∂Hᵀ W r, W held. docs/theory/odometry.md, eq. 5.
void MotionModel::derive(const Gain& gain, const Increment& increment, TwistStep& step) const {
  const auto derivatives = std::span(step.derivative).first(parameters_);
  std::ranges::fill(derivatives, Triple{});
  for (const ReadingChange& change : reading_changes_)
    add_scaled(derivatives[change.parameter], change.dz * input_of(increment, change.input, wheels_),
               gain.by_row[change.row]);
  for (const RowChange& change : row_changes_) {
    Triple& derivative = derivatives[change.parameter];
    add_scaled(derivative, -dot(change.dh, step.twist), gain.by_row[change.row]);
    if (square_) continue;  // no residual
    const double weighed = gain.weight[change.row] * residual(change.row, increment, step.twist);
    add_scaled(derivative, weighed, product(gain.inverse_normal, change.dh));
  }
  if (clock_)
    add_scaled(derivatives[clock_->parameter], -clock_->scale * increment.gyro_change_rad_s,
               gain.by_row[clock_->row]);
}

double MotionModel::residual(std::size_t row, const Increment& increment, const Triple& twist) const {
  double z = 0.0;
  for (std::size_t k = 0; k < inputs_; ++k) z += reading_[row][k] * input_of(increment, k, wheels_);
  return z - dot(h_[row], twist);
}

}  // namespace trundle::odometry
