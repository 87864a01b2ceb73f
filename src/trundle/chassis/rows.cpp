#include "trundle/chassis/rows.hpp"

#include <Eigen/Dense>

namespace trundle {
namespace {

// Readings are never perfect, whatever the robot file says: 1 µm of travel, 1 nrad of turn.
constexpr double kTravelFloor_m = 1e-6;
constexpr double kTurnFloor_rad = 1e-9;
// Rows and columns are compared after scaling levers by this length, so that metres and radians are alike.
constexpr double kSameRow = 1e-9;
constexpr double kRankLimit = 1e-9;

double squared(double x) {
  return x * x;
}

void append(Rows& rows, const Row& row, const Vector3& h) {
  const int i = rows.count();
  rows.H.conservativeResize(i + 1, 3);
  rows.H.row(i) = h.transpose();
  rows.row[static_cast<std::size_t>(i)] = row;
}

bool has_lateral_row(const Rows& rows, const Vector3& h) {
  for (int i = rows.measured; i < rows.count(); ++i) {
    const Vector3 other = rows.H.row(i).transpose();
    if ((other - h).norm() < kSameRow || (other + h).norm() < kSameRow) return true;
  }
  return false;
}

void append_measured_rows(Rows& rows, const Chassis& chassis, bool with_gyro) {
  if (chassis.wheel_count == 0) {
    append(rows, {RowKind::forward}, {1.0, 0.0, 0.0});
    append(rows, {RowKind::turn}, {0.0, 0.0, 1.0});
  }
  for (int i = 0; i < chassis.wheel_count; ++i)
    append(rows, {RowKind::wheel, i}, rolling_row(chassis.wheels()[static_cast<std::size_t>(i)]));
  if (with_gyro && chassis.gyro) append(rows, {RowKind::gyro}, {0.0, 0.0, 1.0});
  rows.measured = rows.count();
}

void append_lateral_rows(Rows& rows, const Chassis& chassis) {
  if (chassis.wheel_count == 0) append(rows, {RowKind::lateral}, {0.0, 1.0, 0.0});
  bool skids = false;
  for (int i = 0; i < chassis.wheel_count; ++i) {
    const Wheel& wheel = chassis.wheels()[static_cast<std::size_t>(i)];
    skids = skids || wheel.kind == WheelKind::skid;
    if (wheel.kind != WheelKind::fixed) continue;
    const Vector3 h = lateral_row(wheel);
    if (!has_lateral_row(rows, h)) append(rows, {RowKind::lateral, i}, h);
  }
  if (skids) append(rows, {RowKind::skid_lateral}, {0.0, 1.0, -chassis.icr_x_m});
}

struct Reading {
  double z = 0.0;
  double variance = 0.0;
};

Reading wheel_reading(const Chassis& chassis, std::size_t i, double turned) {
  const Wheel& wheel = chassis.wheels()[i];
  const double travel = kPi * wheel.diameter_m * turned;
  const double quantum =
      wheel.ticks_per_revolution == 0.0 ? 0.0 : kPi * wheel.diameter_m / wheel.ticks_per_revolution;
  return {travel, squared(wheel_noise(chassis, i)) * std::abs(travel) + squared(quantum) / 6.0 +
                      squared(kTravelFloor_m)};
}

Reading gyro_reading(const Gyro& gyro, const Increment& increment) {
  return {(increment.gyro_rad - gyro.bias_rad_s * increment.duration_s) * gyro.scale,
          squared(gyro.noise_rad_s_sqrt_hz * gyro.scale) * increment.duration_s + squared(kTurnFloor_rad)};
}

Reading lateral_reading(double per_sqrt_m, double mean_travel) {
  return {0.0, squared(per_sqrt_m) * mean_travel + squared(kTravelFloor_m)};
}

double mean_travel_of(const Chassis& chassis, const Increment& increment) {
  if (chassis.wheel_count == 0) return std::abs(increment.turned[0]);
  double sum = 0.0;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    sum += std::abs(kPi * chassis.wheels()[i].diameter_m * increment.turned[i]);
  return sum / chassis.wheel_count;
}

Reading reading_of(const Chassis& chassis, const Row& row, const Increment& increment, double mean_travel) {
  const ChassisNoise& noise = chassis.noise;
  switch (row.kind) {
    case RowKind::wheel: {
      const auto i = static_cast<std::size_t>(row.wheel);
      return wheel_reading(chassis, i, increment.turned[i]);
    }
    case RowKind::gyro:
      return gyro_reading(*chassis.gyro, increment);
    case RowKind::lateral:
      return lateral_reading(noise.lateral_per_sqrt_m, mean_travel);
    case RowKind::skid_lateral:
      return lateral_reading(noise.skid_per_sqrt_m, mean_travel);
    case RowKind::forward:
      return {increment.turned[0],
              squared(noise.wheel_per_sqrt_m) * std::abs(increment.turned[0]) + squared(kTravelFloor_m)};
    case RowKind::turn:
      return {increment.turned[1], squared(noise.turn_per_sqrt_rad) * std::abs(increment.turned[1]) +
                                       squared(noise.turn_per_sqrt_m) * std::abs(increment.turned[0]) +
                                       squared(kTurnFloor_rad)};
  }
  return {};
}

/// H with its turn column divided by the size of the robot, so that all columns are of order one.
RowMatrix scaled(const RowMatrix& H) {
  RowMatrix scaled = H;
  const double size = H.col(2).cwiseAbs().maxCoeff();
  if (size > 0.0) scaled.col(2) /= size;
  return scaled;
}

bool parallel(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const double product = a.norm() * b.norm();
  return product < kRankLimit || std::abs(std::abs(a.dot(b)) - product) < kRankLimit * product;
}

}  // namespace

// From the geometry alone, so that the noise of an interval, which may differ by many orders from row to row,
// has no say in the rank.
Combinations left_null_space(const Rows& rows) {
  const RowMatrix H = scaled(rows.H.topRows(rows.measured));
  Eigen::ColPivHouseholderQR<RowMatrix> qr(H);
  qr.setThreshold(kRankLimit);
  const Combinations Q = qr.householderQ() * Combinations::Identity(rows.measured, rows.measured);
  return Q.rightCols(rows.measured - qr.rank());
}

Vector3 rolling_row(const Wheel& wheel) {
  const double c = std::cos(wheel.direction_rad);
  const double s = std::sin(wheel.direction_rad);
  const Vector3 rolling(c, s, wheel.x_m * s - wheel.y_m * c);
  if (wheel.kind != WheelKind::mecanum) return rolling;
  return rolling + std::tan(wheel.roller_rad) * lateral_row(wheel);
}

Vector3 lateral_row(const Wheel& wheel) {
  const double c = std::cos(wheel.direction_rad);
  const double s = std::sin(wheel.direction_rad);
  return {-s, c, wheel.x_m * c + wheel.y_m * s};
}

Rows rows_of(const Chassis& chassis, bool with_gyro) {
  Rows rows;
  append_measured_rows(rows, chassis, with_gyro);
  append_lateral_rows(rows, chassis);
  return rows;
}

Readings readings_of(const Chassis& chassis, const Rows& rows, const Increment& increment) {
  const double mean_travel = mean_travel_of(chassis, increment);
  const int own_rows =
      chassis.wheel_count > 0 ? chassis.wheel_count : 2;  // of wheels, or of forward and turn
  Readings readings{RowVector(rows.count()), RowVector(rows.count())};
  for (int i = 0; i < rows.count(); ++i) {
    const Reading reading =
        reading_of(chassis, rows.row[static_cast<std::size_t>(i)], increment, mean_travel);
    readings.z[i] = reading.z;
    readings.variance[i] =
        reading.variance + (i < own_rows ? increment.slip_variance[static_cast<std::size_t>(i)] : 0.0);
  }
  return readings;
}

TwistEstimate estimate_twist(const Rows& rows, const Readings& readings) {
  const RowMatrix WH = readings.variance.cwiseInverse().asDiagonal() * rows.H;
  const Matrix3 covariance = (rows.H.transpose() * WH).inverse();
  return {Twist2::from(covariance * (WH.transpose() * readings.z)), covariance};
}

// min over ξ of (z − Hξ)ᵀ W (z − Hξ) = zᵀ P (Pᵀ W⁻¹ P)⁻¹ Pᵀ z.
ResidualTest residual_test(const Rows& rows, const Readings& readings) {
  const Combinations P = left_null_space(rows);
  if (P.cols() == 0) return {};
  const RowVector y = P.transpose() * readings.z.head(rows.measured);
  const Combinations S = P.transpose() * readings.variance.head(rows.measured).asDiagonal() * P;
  return {y.dot(S.llt().solve(y)), static_cast<int>(P.cols())};
}

Observability observability(const Rows& rows) {
  Observability result;
  const Eigen::MatrixXd H = scaled(rows.H);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(H, Eigen::ComputeFullV);
  for (int i = 0; i < 3; ++i) {
    if (i < svd.singularValues().size() && svd.singularValues()[i] > kRankLimit) {
      ++result.rank;
    } else {
      result.unobservable.emplace_back(svd.matrixV().col(i));
    }
  }
  const Combinations P = left_null_space(rows);
  result.degrees_of_freedom = static_cast<int>(P.cols());
  for (int i = 0; i < rows.measured; ++i)
    if (P.row(i).norm() < kRankLimit) result.undetectable.push_back(i);
  if (result.degrees_of_freedom == 0) return result;
  for (int i = 0; i < rows.measured; ++i)
    for (int j = i + 1; j < rows.measured; ++j)
      if (parallel(P.row(i), P.row(j))) result.confusable.emplace_back(i, j);
  return result;
}

}  // namespace trundle
