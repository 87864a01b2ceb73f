#include "trundle/slip/parity.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"

namespace trundle::slip {
namespace {

// An error of a wheel that moves the residual by less than this share of itself is not checked by any other.
constexpr double kUnchecked = 1e-9;
constexpr double kStillGyro = 4.0;  // sigmas

/// A step of the test allocates nothing: geometry::rank_of(), for matrices of any size, does.
Eigen::Index rank_without_heap(const RowMatrix& rows) {
  return Eigen::ColPivHouseholderQR<RowMatrix>(rows).rank();
}

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

/// Of one steering that is read in whole ticks, in which it stays through an interval [rad²].
double steering_rounding_variance(const Wheel& wheel) {
  const SteeringSensor& steering = *wheel.steering;
  if (steering.ticks_per_revolution == 0.0) return 0.0;
  return squared(steering.scale * 2.0 * kPi / steering.ticks_per_revolution) / 12.0;
}

/// The angle that moves the end of a way by so much [rad].
double misread_by(double chord_m, double travel_m) {
  return travel_m == 0.0 ? 0.0 : 2.0 * std::asin(std::clamp(0.5 * chord_m / travel_m, -1.0, 1.0));
}

Rows checked_rows(const Robot& robot) {
  if (robot.chassis.wheel_count == 0)
    throw CannotAnswer(fmt::format("robot '{}' has no wheels: slip cannot be attributed", robot.name));
  Rows rows = checking_rows(robot.chassis, true);
  if (observability(rows).degrees_of_freedom == 0)
    throw CannotAnswer(
        fmt::format("robot '{}': slip is not observable: no redundant measurement; a gyro or another "
                    "wheel{} would be one",
                    robot.name, chassis::is_steered(robot.chassis) ? " with an encoder" : ""));
  return rows;
}

/// By how much more or less than the robot file says clean residuals scatter, over all of them.
double typical_scale(const ParityMatrix& scale) {
  return scale.norm() / std::sqrt(static_cast<double>(scale.rows()));
}

}  // namespace

bool can_show_slip(const Chassis& chassis, bool with_gyro) {
  return observability(checking_rows(chassis, with_gyro)).degrees_of_freedom > 0;
}

Faults::Faults(const Chassis& chassis) {
  const int wheels = chassis.wheel_count;
  for (int i = 0; i < wheels; ++i) faults_[size_++] = {i, false};
  for (int i = 0; i < wheels; ++i)
    if (chassis.wheels()[static_cast<std::size_t>(i)].steering) faults_[size_++] = {i, true};
}

Parity::Parity(const Robot& robot)
    : chassis_(robot.chassis),
      rows_(checked_rows(robot)),
      is_steered_(has_steered_encoders(robot.chassis)),
      faults_(robot.chassis),
      combinations_(left_null_space(rows_)) {
  const double lever = rows_.H.col(2).cwiseAbs().maxCoeff();
  size_ = {1.0, 1.0, lever > 0.0 ? lever : 1.0};
  twist_from_readings_ = twist_solver(rows_, size_[2]);
  if (chassis_.gyro) gyro_scale_ = chassis_.gyro->scale;
  for (int i = 0; i < rows_.measured; ++i) {
    const Row& row = rows_.row[static_cast<std::size_t>(i)];
    if (row.kind == RowKind::gyro) gyro_row_ = i;
    if (row.kind == RowKind::lateral) lateral_row_[static_cast<std::size_t>(row.wheel)] = i;
  }
}

bool Parity::is_checked(const Fault& fault) const {
  const Wheel& wheel = chassis_.wheels()[static_cast<std::size_t>(fault.wheel)];
  const auto is_seen = [&](int row) { return combinations_.row(row).norm() >= kUnchecked; };
  return is_seen(fault.wheel) ||
         (wheel.steering && is_seen(lateral_row_[static_cast<std::size_t>(fault.wheel)]));
}

Parity::Raw Parity::raw(const JudgedInterval& interval, double timing_sigma_s) const {
  const Increment& increment = interval.readings;
  const GyroBias& bias = interval.bias;
  Raw raw;
  raw.readings = readings_of(chassis_, rows_, increment);
  Readings& readings = raw.readings;
  if (chassis_.gyro) {
    const double bias_turn = gyro_scale_ * increment.duration_s;
    readings.z[gyro_row_] += (chassis_.gyro->bias_rad_s - bias.rad_s) * bias_turn;
    readings.variance[gyro_row_] += bias.variance * bias_turn * bias_turn;
    const double jitter = timing_sigma_s * interval.turn_rate_change_rad_s;
    readings.variance[gyro_row_] += jitter * jitter;
  }
  if (is_steered_) {
    read_in_body_axes(interval, raw);
    return raw;
  }
  const auto measured = readings.z.head(rows_.measured);
  raw.y = combinations_.transpose() * measured;
  raw.covariance = combined_covariance(combinations_, readings.variance);
  raw.twist = twist_from_readings_ * readings.z;
  return raw;
}

/// docs/theory/slip-detection.md, eq. 6a.
void Parity::read_in_body_axes(const JudgedInterval& interval, Raw& raw) const {
  ContactMotions contacts = interval.contacts.value_or(ContactMotions{});
  if (!interval.contacts) add_interval(chassis_, interval.readings, contacts);
  RowVector z = raw.readings.z;
  Combinations V = raw.readings.variance.asDiagonal();
  for (int i = 0; i < chassis_.wheel_count; ++i) {
    const auto w = static_cast<std::size_t>(i);
    Wheel wheel = chassis_.wheels()[w];
    if (!wheel.steering) continue;
    const ContactMotion& contact = contacts[w];
    wheel.steering->reading_rad = interval.readings.steering_rad[w];
    const Eigen::Vector2d last(std::cos(rolling_direction(wheel)), std::sin(rolling_direction(wheel)));
    const Eigen::Vector2d way(contact.x_m, contact.y_m);
    const double way_m = way.norm();
    raw.direction[w] = way_m > 0.0 ? way * (std::copysign(1.0, raw.readings.z[i]) / way_m) : last;
    const Eigen::Vector2d across(-contact.y_m, contact.x_m);
    Eigen::Matrix2d covariance;
    covariance << contact.variance_xx, contact.variance_xy, contact.variance_xy, contact.variance_yy;
    const Eigen::Vector2d rolled(contact.last_x, contact.last_y);
    const bool is_still = rolled.isZero();  // by less than a count
    const Eigen::Vector2d rounded = is_still ? Eigen::Vector2d(std::sqrt(2.0) * last) : rolled;
    covariance += rounding_variance(wheel) * rounded * rounded.transpose();
    covariance += steering_rounding_variance(wheel) * across * across.transpose();
    const int j = lateral_row_[w];
    z[i] = contact.x_m;
    z[j] = contact.y_m;
    V(i, i) = covariance(0, 0);
    V(i, j) = V(j, i) = covariance(0, 1);
    V(j, j) = covariance(1, 1);
  }
  raw.y = combinations_.transpose() * z;
  raw.covariance = combinations_.transpose() * V * combinations_;
  raw.twist = twist_from_readings_ * z;
}

/// By how much y changes for a metre of it. An angle that is misread by δ moves the contact point along a
/// chord, which is δ/2 from the normal of its direction: docs/theory/slip-detection.md, eq. 8a.
ParityVector Parity::direction_of(const Fault& fault, const Raw& raw, double misread_rad) const {
  const auto w = static_cast<std::size_t>(fault.wheel);
  const auto along_x = combinations_.row(fault.wheel).transpose();
  if (!chassis_.wheels()[w].steering) return along_x;
  const auto along_y = combinations_.row(lateral_row_[w]).transpose();
  const Eigen::Vector2d& ahead = raw.direction[w];
  if (!fault.sideways) return ahead.x() * along_x + ahead.y() * along_y;
  const double c = std::cos(0.5 * misread_rad), s = std::sin(0.5 * misread_rad);
  return (s * ahead.x() - c * ahead.y()) * along_x + (s * ahead.y() + c * ahead.x()) * along_y;
}

Contradiction Parity::contradiction(const JudgedInterval& interval, const ResidualModel* model) const {
  Raw raw = this->raw(interval, model ? model->timing_sigma_s : 0.0);
  const Eigen::LLT<Eigen::Ref<ParityMatrix>> cholesky(raw.covariance);  // in place
  const auto whiten = [&](auto&& x) {
    cholesky.matrixL().solveInPlace(x);
    if (model) model->scale.triangularView<Eigen::Lower>().solveInPlace(x);
  };
  Contradiction result;
  result.e = raw.y;
  if (model) result.e -= model->by_motion * raw.twist;
  whiten(result.e);
  result.chi2 = result.e.squaredNorm();
  if (is_steered_) {
    result.towards.resize(result.e.size(), static_cast<Eigen::Index>(faults_.size()));
  } else {
    result.towards = combinations_.topRows(chassis_.wheel_count).transpose();
    whiten(result.towards);
  }
  ParityVector by_bias = ParityVector::Zero(result.e.size());
  if (chassis_.gyro) {
    by_bias = combinations_.row(gyro_row_).transpose() *
              (std::sqrt(interval.bias.variance) * gyro_scale_ * interval.readings.duration_s);
    whiten(by_bias);
    result.gyro_rad = raw.readings.z[gyro_row_];
    result.gyro_sigma_rad = std::sqrt(raw.readings.variance[gyro_row_]);
  }
  const double noise_scale = model ? typical_scale(model->scale) : 1.0;
  for (std::size_t i = 0; i < wheels(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    result.travel[i] = raw.readings.z[row];
    result.travel_sigma[i] = noise_scale * std::sqrt(raw.readings.variance[row]);
  }
  if (is_steered_)
    result.longest_slip_m = std::abs(
        *std::ranges::max_element(result.travel, {}, [](double travel_m) { return std::abs(travel_m); }));
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    if (is_steered_) {
      ParityVector towards = direction_of(faults_[i], raw, 0.0);
      whiten(towards);
      if (const double square = towards.squaredNorm(); faults_[i].sideways && square > 0.0) {
        const double travel_m = result.travel[static_cast<std::size_t>(faults_[i].wheel)];
        towards = direction_of(faults_[i], raw, misread_by(towards.dot(result.e) / square, travel_m));
        whiten(towards);
      }
      result.towards.col(column) = towards;
    }
    const double length = result.towards.col(column).norm();
    if (length * result.travel_sigma[static_cast<std::size_t>(faults_[i].wheel)] < kUnchecked) continue;
    if (length * result.longest_slip_m < 1.0) continue;
    result.towards.col(column) /= length;
    result.score[i] = result.towards.col(column).dot(result.e);
    result.excess_m[i] = result.score[i] / length;
    result.excess_sigma_m[i] = 1.0 / length;
    result.drift[i] = std::abs(result.towards.col(column).dot(by_bias));
  }
  return result;
}

IndistinctFaults Parity::indistinct_faults(const Twist2& motion) const {
  Raw raw;
  for (int i = 0; i < chassis_.wheel_count; ++i) {
    const auto w = static_cast<std::size_t>(i);
    if (!chassis_.wheels()[w].steering) continue;
    const Eigen::Vector2d way = Eigen::Vector2d(rows_.H.row(i).dot(motion.vector()),
                                                rows_.H.row(lateral_row_[w]).dot(motion.vector()));
    raw.direction[w] = way.norm() > 0.0 ? Eigen::Vector2d(way.normalized()) : Eigen::Vector2d::UnitX();
  }
  IndistinctFaults result;
  std::vector<std::pair<Fault, ParityVector>> seen;
  for (std::size_t i = 0; i < faults_.size(); ++i) {
    const ParityVector towards = direction_of(faults_[i], raw, 0.0);
    if (towards.norm() < kUnchecked) {
      result.unseen.push_back(faults_[i]);
      continue;
    }
    for (const auto& [other, direction] : seen)
      if (1.0 - std::abs(direction.dot(towards.normalized())) < kUnchecked)
        result.alike.emplace_back(other, faults_[i]);
    seen.emplace_back(faults_[i], towards.normalized());
  }
  return result;
}

/// Rows that read zero: what stands still, and axles that are not steered.
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
  if (uses_gyro() && std::abs(c.gyro_rad) < kStillGyro * c.gyro_sigma_rad) keep(gyro_row_);
  for (int i = 0; i < rows.measured; ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    if (row.kind == RowKind::skid_lateral || (row.kind == RowKind::lateral && !rolls(c, row.wheel))) keep(i);
  }
  if (turning < 2 || still.rows() == 0) return false;
  return rank_without_heap(still) == rank_without_heap(rows.H.topRows(rows.measured));
}

/// Whether a steered wheel with an encoder turns.
bool Parity::rolls(const Contradiction& c, int wheel) const {
  return wheel < chassis_.wheel_count && chassis_.wheels()[static_cast<std::size_t>(wheel)].steering &&
         c.travel[static_cast<std::size_t>(wheel)] != 0.0;
}

}  // namespace trundle::slip
