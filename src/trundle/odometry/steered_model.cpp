#include "trundle/odometry/steered_model.hpp"

#include <algorithm>

#include <Eigen/LU>

#include "trundle/chassis/contact.hpp"
#include "trundle/chassis/ground_turned.hpp"

namespace trundle::odometry {
namespace {

Triple triple_of(const Vector3& v) {
  return {v.x(), v.y(), v.z()};
}

/// The increment whose only reading is that column of SteeredSums::Input, of size one.
Increment unit_of(std::size_t column) {
  Increment increment{.has_gyro = true};
  if (column < kMaxWheels) increment.turned[column] = 1.0;
  if (column == kMaxWheels) increment.gyro_rad = 1.0;
  if (column == kMaxWheels + 1) increment.duration_s = 1.0;
  return increment;
}

SteeredSums::Wheel wheel_of(const Wheel& wheel, std::size_t index) {
  return {.index = index,
          .x_m = wheel.x_m,
          .y_m = wheel.y_m,
          .direction_rad = wheel.direction_rad,
          .scale = wheel.steering->scale,
          .zero_rad = wheel.steering->zero_rad,
          .metres = kPi * wheel.diameter_m,
          .rolling = 0.0,
          .lateral = 0.0};
}

bool is_of_steered_wheel(const Chassis& chassis, const Row& row) {
  return row.wheel >= 0 && chassis.all_wheels()[static_cast<std::size_t>(row.wheel)].steering.has_value();
}

}  // namespace

SteeredModel::SteeredModel(const Chassis& chassis, std::span<const Parameter> parameters, bool with_gyro)
    : chassis_(chassis),
      parameters_(parameters.begin(), parameters.end()),
      with_gyro_(with_gyro),
      gauge_(chassis) {
  const bool square = rows_of(chassis, with_gyro).count() == 3;
  const std::size_t weighings = square || !with_gyro ? 1 : kOctaves;
  for (std::size_t octave = 0; octave < weighings; ++octave) sums_.push_back(sums_of(octave));
}

SteeredSums SteeredModel::sums_of(std::size_t octave) const {
  SteeredSums sums;
  const Rows rows = rows_of(chassis_, with_gyro_);
  const RowVector weight =
      weighing_variances(chassis_, rows, gauge_.octave_speed(octave), 1.0).cwiseInverse();
  for (std::size_t i = 0; i < chassis_.all_wheels().size(); ++i)
    if (const Wheel& wheel = chassis_.all_wheels()[i]; wheel.steering)
      sums.wheel[sums.wheel_count++] = wheel_of(wheel, i);
  RowVector others = RowVector::Zero(rows.count());  // weights of the rows that are always the same
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (!is_of_steered_wheel(chassis_, row)) {
      others[i] = weight[i];
      add_outer(sums.normal, weight[i], triple_of(rows.H.row(i).transpose()));
      continue;
    }
    SteeredSums::Wheel& wheel =
        *std::ranges::find(sums.wheel, static_cast<std::size_t>(row.wheel), &SteeredSums::Wheel::index);
    (row.kind == RowKind::wheel ? wheel.rolling : wheel.lateral) = weight[i];
  }
  for (std::size_t column = 0; column < kMaxInputs; ++column) {
    const RowVector z = readings_of(chassis_, rows, unit_of(column)).z;
    const Vector3 by_input = rows.H.transpose() * others.cwiseProduct(z);
    if (!by_input.isZero(0.0)) sums.input[sums.input_count++] = {column, triple_of(by_input)};
  }
  return sums;
}

bool SteeredModel::slips(const Increment& increment) const {
  return std::ranges::any_of(increment.slip_variance, [](double variance) { return variance > 0.0; });
}

Triple SteeredModel::twist(const Increment& increment, std::size_t octave) const {
  if (!slips(increment)) {
    const auto input = [&](std::size_t column) {
      if (column < kMaxWheels) return ground_turned(chassis_, column, increment);
      return column == kMaxWheels ? increment.gyro_rad : increment.duration_s;
    };
    const auto steering = [&](std::size_t wheel) { return increment.steering_rad[wheel]; };
    const SteeredTwist<double> twist = one_number::steered_twist<double>(sums(octave), input, steering);
    if (twist.seen > 0.0) [[likely]]
      return {twist.dx, twist.dy, twist.dtheta};
  }
  const Standing standing = standing_in(increment, octave);
  return triple_of(standing.gain * readings_of(standing.chassis, standing.rows, increment).z);
}

SteeredModel::Standing SteeredModel::standing_in(const Increment& increment, std::size_t octave) const {
  Standing standing{at_steering(chassis_, increment), rows_at(chassis_, increment, with_gyro_), {}, {}, {}};
  const Rows& rows = standing.rows;
  const double speed_m_s = gauge_.octave_speed(has_one_weighing() && !slips(increment) ? 0 : octave);
  RowVector variance = weighing_variances(chassis_, rows, speed_m_s, 1.0);
  if (slips(increment))  // what slips counts for less: of an interval, not of a second
    variance = variance * increment.duration_s +
               variance_of(standing, {.slip_variance = increment.slip_variance}, {}, Vector3::Zero());
  standing.weight = variance.cwiseInverse();
  const Gain HtW = rows.H.transpose() * standing.weight.asDiagonal();
  standing.inverse_normal = (HtW * rows.H).inverse();
  standing.gain = standing.inverse_normal * HtW;
  return standing;
}

/// Without the rounding of counts, as MotionModel has it.
RowVector SteeredModel::variance_of(const Standing& standing, const Increment& increment,
                                    const Rolled& rolled, const Vector3& twist) const {
  const Increment sure{.duration_s = increment.duration_s,
                       .turned = rolled,
                       .has_gyro = true,
                       .slip_variance = increment.slip_variance};
  RowVector variance = readings_of(standing.chassis, standing.rows, sure).variance;
  for (int i = 0; i < standing.rows.count(); ++i) {
    const Row& row = standing.rows.row[static_cast<std::size_t>(i)];
    if (row.kind == RowKind::wheel)
      variance[i] -=
          2.0 * rounding_variance(standing.chassis.all_wheels()[static_cast<std::size_t>(row.wheel)]);
  }
  return variance + misreading_variances(standing.chassis, standing.rows, twist);
}

void SteeredModel::twist_with_covariance(const Increment& increment, const Rolled& rolled, std::size_t octave,
                                         TwistStep& step) const {
  const Standing standing = standing_in(increment, octave);
  const Rows& rows = standing.rows;
  step.twist = twist(increment, octave);
  const Vector3 twist = Eigen::Map<const Vector3>(step.twist.data());
  step.covariance =
      symmetric_of(standing.gain * variance_of(standing, increment, rolled, twist).asDiagonal() *
                   standing.gain.transpose());
  step.by_travel = {};
  for (int i = 0; i < chassis_.wheel_count; ++i) {
    const auto wheel = static_cast<std::size_t>(i);
    step.by_travel.x[wheel] = standing.gain(0, i);
    step.by_travel.y[wheel] = standing.gain(1, i);
    step.by_travel.h[wheel] = standing.gain(2, i);
  }
  if (parameters_.empty()) return;
  const RowVector z = readings_of(standing.chassis, rows, increment).z;
  const RowVector weighed = standing.weight.cwiseProduct(z - rows.H * twist);
  for (std::size_t j = 0; j < parameters_.size(); ++j) {  // odometry.md, eq. 5
    const RowMatrix dH = row_derivative(parameters_[j], standing.chassis, rows);
    const RowVector dz = reading_derivative(parameters_[j], standing.chassis, rows, increment);
    step.derivative[j] =
        triple_of(standing.gain * (dz - dH * twist) + standing.inverse_normal * (dH.transpose() * weighed));
  }
}

Triple SteeredModel::response_to_turn(const Increment& increment, std::size_t octave) const {
  const Standing standing = standing_in(increment, octave);
  return triple_of(standing.gain.col(standing.rows.measured - 1));
}

}  // namespace trundle::odometry
