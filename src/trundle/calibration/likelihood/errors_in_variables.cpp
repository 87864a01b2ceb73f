#include "trundle/calibration/likelihood/errors_in_variables.hpp"

#include <cmath>
#include <utility>

#include <Eigen/LU>

#include "trundle/chassis/contact.hpp"
#include "trundle/geometry/gaussian.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/odometry/arc.hpp"

namespace trundle::calibration {
namespace {

/// The matrix whose columns are what a linear map makes of the unit vectors.
template <class Map>
Matrix3 matrix_of(const Map& map) {
  Matrix3 matrix;
  for (int i = 0; i < 3; ++i) {
    std::array<double, 3> unit{};
    unit[static_cast<std::size_t>(i)] = 1.0;
    const std::array<double, 3> column = map(unit);
    matrix.col(i) = Eigen::Map<const Vector3>(column.data());
  }
  return matrix;
}

/// What ∂H ξ errs by where angles of steered wheels are misread, per unit error of each reading that such a
/// wheel does not skid: by its angle's error ε that is ε d · ξ. docs/theory/calibration-redundancy.md, eq.
/// 7d. Zero for no motion: of a robot that stands the gyro's noise makes one that rolls by next to nothing.
Eigen::MatrixXd derivative_by_misreading(const Parameter& parameter, const Chassis& chassis, const Rows& rows,
                                         const Vector3& motion) {
  constexpr double kStep = 1e-4;
  Eigen::MatrixXd by_reading = Eigen::MatrixXd::Zero(rows.count(), rows.count());
  for (int i = 0; i < rows.count(); ++i) {
    if (!is_of_angle(chassis, rows.row[static_cast<std::size_t>(i)])) continue;
    const int at = rows.row[static_cast<std::size_t>(i)].wheel;
    const double rolled_m = rolling_row(chassis.all_wheels()[static_cast<std::size_t>(at)]).dot(motion);
    if (rolled_m == 0.0) continue;
    const auto derivative_at = [&](double turned_rad) {
      Chassis turned = chassis;
      SteeringSensor& steering = *turned.all_wheels()[static_cast<std::size_t>(at)].steering;
      steering.reading_rad += turned_rad / steering.scale;
      return row_derivative(parameter, turned, rows);
    };
    by_reading.col(i) = (derivative_at(kStep) - derivative_at(-kStep)) / (2.0 * kStep) * motion / rolled_m;
  }
  return by_reading;
}

}  // namespace

ArcErrors arc_errors(const Pose2& from, const Pose2& to) {
  const Twist2 twist = log(from.inverse() * to);
  const ArcStep arc(from.heading, {twist.dx, twist.dy, twist.dtheta});
  return {matrix_of([&](const std::array<double, 3>& v) { return arc.carry(v); }),
          matrix_of([&](const std::array<double, 3>& v) { return arc.map(v); })};
}

ReadingErrors ReadingErrors::mapped(const Matrix3& map) const {
  ReadingErrors result{map * sensitivity, Eigen::Matrix3Xd::Zero(3, covariance.cols()), scatter};
  map_threes(map, scatter.cols() / 3, result.scatter);
  for (Eigen::Index at = 0; at < sensitivity.cols(); at += 3) {
    auto C = result.sensitivity.middleCols<3>(at);
    C = (C * map.transpose()).eval();
  }
  for (Eigen::Index i = 0; 3 * i < covariance.cols(); ++i) {
    const Matrix3 T = map * covariance.middleCols<3>(3 * i) * map.transpose();
    for (Eigen::Index k = 0; k < 3; ++k) result.covariance.middleCols<3>(3 * k) += map(k, i) * T;
  }
  return result;
}

SensitivityErrors::SensitivityErrors(const Robot& robot, std::span<const Parameter> parameters,
                                     const Pose2& pose, const Chassis& as_read, bool with_scatter)
    : chassis_(robot.chassis),
      as_read_(as_read),
      parameters_(parameters.begin(), parameters.end()),
      covariance_(parameters.size(), Matrix3::Zero()),
      third_moment_(Eigen::Matrix<double, 3, 9>::Zero()),
      arc_start_(pose) {
  if (with_scatter) scatter_.emplace(parameters.size());
  // Of successive readings it cancels, but for those of the last counts.
  for (Wheel& wheel : as_read_.wheels()) wheel.ticks_per_revolution = 0.0;
  linearise(chassis_, rows_of(chassis_, chassis_.gyro.has_value()), Vector3::Zero());
}

void SensitivityErrors::linearise(const Chassis& chassis, const Rows& rows, const Vector3& motion) {
  at_steering_ = chassis;
  rows_ = rows;
  gain_ = twist_gain(rows, weighing_variances(chassis, rows, 1.0, 1.0));
  sensitivity_gain_.clear();
  rows_by_twist_.clear();
  for (const Parameter& parameter : parameters_) {
    const RowVector growth = reading_growth(parameter, chassis, rows);
    const RowMatrix dH = row_derivative(parameter, chassis, rows);
    const Eigen::MatrixXd by_misreading = derivative_by_misreading(parameter, chassis, rows, motion);
    sensitivity_gain_.emplace_back(gain_ * growth.asDiagonal() - gain_ * (dH * gain_ + by_misreading));
    rows_by_twist_.emplace_back(growth.asDiagonal() * rows.H - dH - by_misreading * rows.H);
  }
}

void SensitivityErrors::propagate(const Increment& increment, const Pose2& pose) {
  if (covariance_.empty()) return;
  travel_.duration_s += increment.duration_s;
  ++increments_;
  for (std::size_t i = 0; i < travel_.turned.size(); ++i) {
    travel_.turned[i] += std::abs(increment.turned[i]);
    signed_travel_.turned[i] += increment.turned[i];
  }
  travel_.steering_rad = increment.steering_rad;
  has_counts_ = has_counts_ || any_turns(increment);
  has_gyro_ = has_gyro_ && (increment.has_gyro || !chassis_.gyro);
  if (travel_.duration_s >= kLongestArc_s) end_arc(pose);
}

// An angle is misread anew in each increment.
RowVector SensitivityErrors::variance_of_rows(const Vector3& motion) const {
  return readings_of(as_read_, rows_, travel_).variance +
         misreading_variances(at_steering_, rows_, motion) / increments_;
}

// Of what the sensors read wrong. Where a robot slides, sideways or scrubbing on skid wheels, its readings
// are right and the ground moves otherwise; and what a heading misses beyond the gyro's own noise is of
// clocks and of the reference. Neither is an error of the sensitivity.
RowVector SensitivityErrors::of_sensors(RowVector variance) const {
  for (int i = rows_.measured; i < rows_.count(); ++i)
    if (!is_of_angle(at_steering_, rows_.row[static_cast<std::size_t>(i)])) variance[i] = 0.0;
  return variance;
}

/// By the length of what is read: ∂V/∂|z|.
RowVector SensitivityErrors::growth_of_variance() const {
  RowVector growth = RowVector::Zero(rows_.count());
  for (int i = 0; i < rows_.measured; ++i) {
    const Row& row = rows_.row[static_cast<std::size_t>(i)];
    const ChassisNoise& noise = chassis_.noise;
    if (row.kind == RowKind::wheel)
      growth[i] = rolling_variance(chassis_, static_cast<std::size_t>(row.wheel), 1.0);
    if (row.kind == RowKind::forward) growth[i] = squared(noise.wheel_per_sqrt_m);
    if (row.kind == RowKind::turn) growth[i] = squared(noise.turn_per_sqrt_rad);
  }
  return growth;
}

Matrix3 SensitivityErrors::noise_of(const std::array<double, kMaxWheels>& turned) const {
  Increment ways;
  ways.turned = turned;
  ways.steering_rad = travel_.steering_rad;
  const RowVector variance =
      growth_of_variance().cwiseProduct(readings_of(chassis_, rows_, ways).z.cwiseAbs());
  return gain_ * variance.asDiagonal() * gain_.transpose();
}

// Eq. 6a, with F and M of the arc; and beside C all else that errs with it.
void SensitivityErrors::end_arc(const Pose2& pose) {
  if (travel_.duration_s <= 0.0) return;
  const auto [F, M] = arc_errors(arc_start_, pose);
  const Twist2 twist = log(arc_start_.inverse() * pose);
  const Vector3 motion(twist.dx, twist.dy, twist.dtheta);
  if (is_steered(chassis_))
    linearise(at_steering(chassis_, travel_), rows_at(chassis_, travel_, chassis_.gyro.has_value()),
              any_turns(travel_) ? motion : Vector3::Zero());
  const RowVector of_rows = variance_of_rows(motion), variance = of_sensors(of_rows);
  propagate_third_moment(F, M, variance);
  for (Matrix3& covariance : covariance_) covariance = (F * covariance * F.transpose()).eval();
  // Without the gyro readings would be weighed otherwise; and little is left out.
  if (has_gyro_) add_covariance(M, variance);
  const RowVector counted = has_gyro_ ? variance : RowVector::Zero(variance.size());
  const std::vector<Eigen::MatrixXd> of_parity = parity_by_reading(of_rows);
  if (scatter_) propagate_scatter(F, M, counted, of_parity);
  propagate_parity(F, M, counted, of_parity);
  arc_start_ = pose;
  travel_ = {};
  signed_travel_ = {};
  increments_ = 0;
  has_gyro_ = true;
}

// By V ∂V/∂z: where a reading is too large, so is the variance that it is said to have.
void SensitivityErrors::propagate_third_moment(const Matrix3& F, const Matrix3& M,
                                               const RowVector& variance) {
  const RowVector of_readings = variance.cwiseProduct(growth_of_variance())
                                    .cwiseProduct(readings_of(chassis_, rows_, signed_travel_).z.cwiseSign());
  const ByReading by = M * gain_;
  third_moment_ = ReadingErrors{Eigen::Matrix3Xd(3, 0), third_moment_, {}}.mapped(F).covariance;
  for (Eigen::Index k = 0; k < 3; ++k)
    third_moment_.middleCols<3>(3 * k) +=
        by * of_readings.cwiseProduct(by.row(k).transpose()).asDiagonal() * by.transpose();
}

/// Of readings with these errors, of a motion that moves the pose by M.
void SensitivityErrors::add_covariance(const Matrix3& M, const RowVector& variance) {
  for (std::size_t j = 0; j < covariance_.size(); ++j)
    covariance_[j] +=
        M * (sensitivity_gain_[j] * variance.asDiagonal() * gain_.transpose()).eval() * M.transpose();
}

// What no motion explains is differentiated at the motion by all readings, each by its own noise:
// docs/theory/calibration-redundancy.md, eq. 7 and 7b.
std::vector<Eigen::MatrixXd> SensitivityErrors::parity_by_reading(const RowVector& variance) const {
  if (parity_.empty()) return {};
  const ByReading motion = (variance.array() > 0.0).all() ? twist_gain(rows_, variance) : gain_;
  std::vector<Eigen::MatrixXd> by_reading;
  for (const RowMatrix& by_twist : rows_by_twist_)
    by_reading.emplace_back(P_.transpose() * by_twist.topRows(P_.rows()) * motion);
  return by_reading;
}

void SensitivityErrors::propagate_scatter(const Matrix3& F, const Matrix3& M, const RowVector& variance,
                                          const std::vector<Eigen::MatrixXd>& parity_by_reading) {
  const auto n = static_cast<Eigen::Index>(covariance_.size());
  const Eigen::Index m = parity_.empty() ? 0 : P_.cols();
  Eigen::MatrixXd by_reading((3 + m) * n, variance.size());
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto at = static_cast<std::size_t>(j);
    by_reading.middleRows<3>(3 * j) = M * sensitivity_gain_[at];
    if (m > 0) by_reading.middleRows(3 * n + m * j, m) = parity_by_reading[at];
  }
  scatter_->propagate(F, by_reading, variance);
}

void SensitivityErrors::propagate_parity(const Matrix3& F, const Matrix3& M, const RowVector& variance,
                                         const std::vector<Eigen::MatrixXd>& by_reading) {
  if (parity_.empty()) return;
  const Eigen::Index n = P_.rows();
  const Eigen::MatrixXd VP = variance.head(n).asDiagonal() * P_;
  const Eigen::MatrixX3d VG = variance.asDiagonal() * (M * gain_).transpose();
  for (std::size_t j = 0; j < parity_.size(); ++j) {
    ParityErrors& parity = parity_[j];
    parity.pose_parity = F * parity.pose_parity + M * (sensitivity_gain_[j].leftCols(n) * VP);
    parity.parity_pose = parity.parity_pose * F.transpose() + by_reading[j] * VG;
    parity.parity_parity += by_reading[j].leftCols(n) * VP;
  }
}

void SensitivityErrors::add_to_parity(const Combinations& P, const Pose2& pose) {
  if (parity_.empty()) {
    end_arc(pose);
    const Eigen::Index m = P.cols();
    parity_.assign(covariance_.size(),
                   {Eigen::MatrixXd::Zero(3, m), Eigen::MatrixXd::Zero(m, 3), Eigen::MatrixXd::Zero(m, m)});
    if (scatter_) scatter_->begin_parity(m);
  }
  P_ = P;
}

void SensitivityErrors::end_parity(const Pose2& pose) {
  if (!parity_.empty()) end_arc(pose);
}

void SensitivityErrors::drop_parity() {
  parity_.clear();
  if (scatter_) scatter_->drop_parity();
}

/// Of all sensitivities' errors, as SensitivityScatter has them: their covariance with the error of the pose.
Eigen::MatrixXd SensitivityErrors::covariance_with_pose() const {
  const auto n = static_cast<Eigen::Index>(covariance_.size());
  const Eigen::Index m = parity_.empty() ? 0 : P_.cols();
  Eigen::MatrixXd covariance((3 + m) * n, 3);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto at = static_cast<std::size_t>(j);
    covariance.middleRows<3>(3 * j) = covariance_[at];
    if (m > 0) covariance.middleRows(3 * n + m * j, m) = parity_[at].parity_pose;
  }
  return covariance;
}

/// The same with the error of the parity residual.
Eigen::MatrixXd SensitivityErrors::covariance_with_parity() const {
  const auto n = static_cast<Eigen::Index>(parity_.size());
  const Eigen::Index m = P_.cols();
  Eigen::MatrixXd covariance((3 + m) * n, m);
  for (Eigen::Index j = 0; j < n; ++j) {
    const ParityErrors& parity = parity_[static_cast<std::size_t>(j)];
    covariance.middleRows<3>(3 * j) = parity.pose_parity;
    covariance.middleRows(3 * n + m * j, m) = parity.parity_parity;
  }
  return covariance;
}

Eigen::MatrixXd SensitivityErrors::noise_in_information(const Matrix3& weight) const {
  return scatter_ ? scatter_->noise_in_pose(weight, covariance_with_pose()) : Eigen::MatrixXd();
}

Eigen::MatrixXd SensitivityErrors::noise_in_parity(const Eigen::MatrixXd& weight) const {
  return scatter_ ? scatter_->noise_in_parity(weight, covariance_with_parity()) : Eigen::MatrixXd();
}

void SensitivityErrors::correct_by_parity(const Eigen::MatrixXd& weight, const CommonError& gain,
                                          const Pose2& pose) {
  arc_start_ = pose;
  if (parity_.empty()) return;
  if (scatter_) scatter_->correct_by_parity(weight, covariance_with_parity(), gain);
  for (std::size_t j = 0; j < parity_.size(); ++j) {
    const ParityErrors& parity = parity_[j];
    covariance_[j] += gain * parity.parity_parity * gain.transpose() - parity.pose_parity * gain.transpose() -
                      gain * parity.parity_pose;
  }
  parity_.clear();
}

void SensitivityErrors::add_last_counts(const Pose2& pose) {
  if (!std::exchange(has_counts_, false)) return;
  RowVector variance = RowVector::Zero(rows_.count());
  for (int i = 0; i < rows_.measured; ++i) {
    const Row& row = rows_.row[static_cast<std::size_t>(i)];
    if (row.kind == RowKind::wheel)
      variance[i] = rounding_variance(chassis_.wheels()[static_cast<std::size_t>(row.wheel)]);
  }
  add_covariance(world_from_body_axes(pose), variance);
}

PoseSensitivity SensitivityErrors::correction(const Vector3& weighed_innovation, const Pose2& pose) {
  end_arc(pose);
  PoseSensitivity result(3, static_cast<Eigen::Index>(covariance_.size()));
  for (std::size_t j = 0; j < covariance_.size(); ++j)
    result.col(static_cast<Eigen::Index>(j)) = covariance_[j] * weighed_innovation;
  return result;
}

void SensitivityErrors::correct(const Matrix3& weight, const Matrix3& keep, const Pose2& pose,
                                const Eigen::MatrixX3d& parity_by_pose) {
  if (scatter_) scatter_->correct_by_pose(weight, covariance_with_pose(), keep, parity_by_pose);
  for (std::size_t j = 0; j < parity_.size(); ++j) {
    ParityErrors& parity = parity_[j];
    const Matrix3& C = covariance_[j];
    const Eigen::MatrixX3d& L = parity_by_pose;
    parity.parity_parity +=
        L * parity.pose_parity + parity.parity_pose * L.transpose() + L * C * L.transpose();
    parity.pose_parity = keep * (parity.pose_parity + C * L.transpose()).eval();
    parity.parity_pose = (parity.parity_pose + L * C).eval() * keep.transpose();
  }
  for (Matrix3& covariance : covariance_) covariance = (keep * covariance * keep.transpose()).eval();
  arc_start_ = pose;
}

ReadingErrors SensitivityErrors::take(const Pose2& pose) {
  end_arc(pose);
  add_last_counts(pose);
  ReadingErrors errors{Eigen::Matrix3Xd(3, 3 * covariance_.size()), third_moment_,
                       scatter_ ? scatter_->take() : Eigen::MatrixXd()};
  for (std::size_t j = 0; j < covariance_.size(); ++j)
    errors.sensitivity.middleCols<3>(3 * static_cast<Eigen::Index>(j)) = covariance_[j];
  for (Matrix3& covariance : covariance_) covariance.setZero();
  third_moment_.setZero();
  arc_start_ = {};
  return errors.mapped(world_from_body_axes(pose).transpose());
}

}  // namespace trundle::calibration
