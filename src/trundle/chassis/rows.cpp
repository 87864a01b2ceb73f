#include "trundle/chassis/rows.hpp"

#include <algorithm>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "trundle/chassis/ground_turned.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::chassis {
namespace {

// 1σ of the least noise: readings are never perfect, whatever the robot file says.
constexpr double kTravelFloor_m = 1e-6;
constexpr double kTurnFloor_rad = 1e-9;  // moves what is a kilometre away by that micrometre
// Entries of rows are of order one, their rounding errors below 1e-15; levers that differ on purpose do so
// by far more than a nanometre.
constexpr double kSameRow = 1e-9;
constexpr double kRankLimit = 1e-9;  // the same for combinations of rows, scaled by the size of the robot
// Steered wheels whose rows are this near to dependent see nothing of the motion that is left: no steering is
// read to a thousandth of a degree.
constexpr double kSteeredRank = 1e-5;

void append(Rows& rows, const Row& row, const Vector3& h) {
  const int i = rows.count();
  rows.H.conservativeResize(i + 1, 3);
  rows.H.row(i) = h.transpose();
  rows.row[static_cast<std::size_t>(i)] = row;
}

/// Of a wheel that is not steered.
bool has_lateral_row(const Rows& rows, const Chassis& chassis, const Vector3& h) {
  for (int i = rows.measured; i < rows.count(); ++i) {
    const int wheel = rows.row[static_cast<std::size_t>(i)].wheel;
    if (chassis.all_wheels()[static_cast<std::size_t>(wheel)].steering) continue;
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
  for (int i = 0; i < chassis.wheel_count + chassis.passive_count; ++i) {
    const Wheel& wheel = chassis.all_wheels()[static_cast<std::size_t>(i)];
    skids = skids || wheel.kind == WheelKind::skid;
    if (wheel.kind != WheelKind::fixed) continue;
    const Vector3 h = lateral_row(wheel);
    if (wheel.steering || !has_lateral_row(rows, chassis, h)) append(rows, {RowKind::lateral, i}, h);
  }
  if (skids) append(rows, {RowKind::skid_lateral}, {0.0, 1.0, -chassis.icr_x_m});
}

double travel_of(const Wheel& wheel, double turned) {
  return kPi * wheel.diameter_m * turned;
}

/// What the noise of a row grows with over an interval.
struct Way {
  double travel_m = 0.0;  ///< of its own wheel; of all on average where it has none
  double turn_rad = 0.0;
  double duration_s = 0.0;
};

double variance_of_travel(double per_sqrt_m, double travel_m) {
  return squared(per_sqrt_m) * travel_m + squared(kTravelFloor_m);
}

/// docs/theory/chassis.md, eq. 5, without the rounding of counts.
double noise_variance(const Chassis& chassis, const Row& row, const Way& way) {
  const ChassisNoise& noise = chassis.noise;
  const auto of_travel = [&](double per_sqrt_m) { return variance_of_travel(per_sqrt_m, way.travel_m); };
  switch (row.kind) {
    case RowKind::wheel:
      return of_travel(row.wheel < chassis.wheel_count
                           ? wheel_noise(chassis, static_cast<std::size_t>(row.wheel))
                           : typical_wheel_noise(chassis));
    case RowKind::lateral:
      return of_travel(noise.lateral_per_sqrt_m);
    case RowKind::skid_lateral:
      return of_travel(noise.skid_per_sqrt_m);
    case RowKind::forward:
      return of_travel(noise.wheel_per_sqrt_m);
    case RowKind::turn:
      return squared(noise.turn_per_sqrt_rad) * way.turn_rad + squared(noise.turn_per_sqrt_m) * way.travel_m +
             squared(kTurnFloor_rad);
    case RowKind::gyro:
      return squared(chassis.gyro->noise_rad_s_sqrt_hz * chassis.gyro->scale) * way.duration_s +
             squared(kTurnFloor_rad);
    case RowKind::unobserved:
      return squared(kUnobservedTurn) * way.duration_s + squared(kTurnFloor_rad);
  }
  return 0.0;
}

/// Of a robot without wheels.
ForwardAndTurn by_velocity(const Chassis& chassis, const Increment& increment) {
  return corrected(chassis.velocity, {increment.turned[0], increment.turned[1]}, increment.duration_s);
}

double reading_of(const Chassis& chassis, const Row& row, const Increment& increment) {
  switch (row.kind) {
    case RowKind::wheel: {
      const auto i = static_cast<std::size_t>(row.wheel);
      return travel_of(chassis.wheels()[i], ground_turned(chassis, i, increment));
    }
    case RowKind::gyro:
      return (increment.gyro_rad - chassis.gyro->bias_rad_s * increment.duration_s) * chassis.gyro->scale;
    case RowKind::forward:
      return by_velocity(chassis, increment).forward_m;
    case RowKind::turn:
      return by_velocity(chassis, increment).turn_rad;
    case RowKind::lateral:
    case RowKind::skid_lateral:
    case RowKind::unobserved:
      return 0.0;
  }
  return 0.0;
}

/// How far a turn of one radian moves what a row measures at most [m].
double size_of(const RowMatrix& H) {
  return H.col(2).cwiseAbs().maxCoeff();
}

/// H with its turn column divided by the size of the robot, so that all columns are of order one.
RowMatrix scaled(const RowMatrix& H) {
  constexpr double kLeastSize_m = 1e-9;  // what is less is rounding of directions
  RowMatrix scaled = H;
  const double size = size_of(H);
  if (size > kLeastSize_m) scaled.col(2) /= size;
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
  return geometry::left_null_space(scaled(rows.H.topRows(rows.measured)), kRankLimit);
}

Combinations combined_covariance(const Combinations& P, const RowVector& variance) {
  return P.transpose() * variance.head(P.rows()).asDiagonal() * P;
}

Vector3 rolling_row(const Wheel& wheel) {
  const double direction = rolling_direction(wheel);
  const double c = std::cos(direction);
  const double s = std::sin(direction);
  const Vector3 rolling(c, s, wheel.x_m * s - wheel.y_m * c);
  if (wheel.kind != WheelKind::mecanum) return rolling;
  return rolling + std::tan(wheel.roller_rad) * lateral_row(wheel);
}

Vector3 lateral_row(const Wheel& wheel) {
  const double direction = rolling_direction(wheel);
  const double c = std::cos(direction);
  const double s = std::sin(direction);
  return {-s, c, wheel.x_m * c + wheel.y_m * s};
}

Rows rows_of(const Chassis& chassis, bool with_gyro) {
  Rows rows;
  append_measured_rows(rows, chassis, with_gyro);
  append_lateral_rows(rows, chassis);
  return rows;
}

Rows rows_at(const Chassis& chassis, const Increment& increment, bool with_gyro) {
  Rows rows = rows_of(at_steering(chassis, increment), with_gyro);
  const Vector3 size(1.0, 1.0, std::max(size_of(rows.H), kSameRow));
  const RowMatrix H = rows.H * size.cwiseInverse().asDiagonal();
  const Matrix3 N = H.transpose() * H;  // λmin/λmax is above kSteeredRank² for this determinant
  if (N.determinant() > 27.0 * kSteeredRank * kSteeredRank * std::pow(N.trace() / 3.0, 3)) return rows;
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(N);  // in growing order
  const Vector3 to_turn(1.0 / size.z(), 1.0 / size.z(), 1.0);
  for (int i = 0; i < 2 && eigen.eigenvalues()[i] <= squared(kSteeredRank) * eigen.eigenvalues()[2]; ++i)
    append(rows, {RowKind::unobserved}, eigen.eigenvectors().col(i).cwiseProduct(to_turn));
  return rows;
}

double rolling_variance(const Chassis& chassis, std::size_t wheel, double travel_m) {
  return variance_of_travel(wheel_noise(chassis, wheel), travel_m);
}

double lateral_variance(const Chassis& chassis, double mean_travel_m) {
  return variance_of_travel(chassis.noise.lateral_per_sqrt_m, mean_travel_m);
}

double mean_travel(const Chassis& chassis, const Increment& increment) {
  if (chassis.wheel_count == 0) return std::abs(chassis.velocity.forward_scale * increment.turned[0]);
  double sum = 0.0;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    sum += std::abs(travel_of(chassis.wheels()[i], increment.turned[i]));
  return sum / chassis.wheel_count;
}

Readings readings_of(const Chassis& chassis, const Rows& rows, const Increment& increment) {
  const double all_m = mean_travel(chassis, increment);
  // The noise is that of what was read; a turn that comes with travel or with time brings none of its own.
  const double turn_rad =
      chassis.wheel_count == 0 ? std::abs(chassis.velocity.yaw_scale * increment.turned[1]) : 0.0;
  const int own_rows =
      chassis.wheel_count > 0 ? chassis.wheel_count : 2;  // of wheels, or of forward and turn
  Readings readings{RowVector(rows.count()), RowVector(rows.count())};
  for (int i = 0; i < rows.count(); ++i) {
    const Row& row = rows.row[static_cast<std::size_t>(i)];
    const bool is_wheel = row.kind == RowKind::wheel;
    readings.z[i] = reading_of(chassis, row, increment);
    readings.variance[i] = noise_variance(
        chassis, row, {is_wheel ? std::abs(readings.z[i]) : all_m, turn_rad, increment.duration_s});
    if (is_wheel)
      readings.variance[i] += 2.0 * rounding_variance(chassis.wheels()[static_cast<std::size_t>(row.wheel)]);
    if (i < own_rows) readings.variance[i] += increment.slip_variance[static_cast<std::size_t>(i)];
    if (is_of_angle(chassis, row))  // a wheel that slips has no hold sideways
      readings.variance[i] += increment.slip_variance[static_cast<std::size_t>(row.wheel)];
  }
  return readings;
}

// The lateral row of a steered wheel weighs what a rolling row does: what H is misread by does not average
// out, but shortens the way by its share of the weight. docs/theory/odometry.md, below eq. 12.
RowVector weighing_variances(const Chassis& chassis, const Rows& rows, double travel_m, double duration_s) {
  RowVector variances(rows.count());
  for (int i = 0; i < rows.count(); ++i) {
    Row row = rows.row[static_cast<std::size_t>(i)];
    if (is_of_angle(chassis, row)) row.kind = RowKind::wheel;
    variances[i] = noise_variance(chassis, row, {travel_m, travel_m, duration_s});
  }
  return variances;
}

bool is_of_angle(const Chassis& chassis, const Row& row) {
  return row.kind == RowKind::lateral && row.wheel >= 0 &&
         chassis.all_wheels()[static_cast<std::size_t>(row.wheel)].steering.has_value();
}

double rounding_variance(const Wheel& wheel) {
  return squared(metres_per_tick(wheel)) / 12.0;
}

Twist2 twist_of(const Chassis& chassis, const Rows& given, const Increment& increment) {
  const Rows rows =
      is_steered(chassis) ? rows_at(chassis, increment, given.measured > chassis.wheel_count) : given;
  return estimate_twist(
             rows, {readings_of(chassis, rows, increment).z, weighing_variances(chassis, rows, 1.0, 1.0)})
      .twist;
}

TwistEstimate estimate_twist(const Rows& rows, const Readings& readings) {
  const RowMatrix WH = readings.variance.cwiseInverse().asDiagonal() * rows.H;
  const Matrix3 covariance = (rows.H.transpose() * WH).inverse();
  return {Twist2::from(covariance * (WH.transpose() * readings.z)), covariance};
}

TwistGain twist_gain(const Rows& rows, const RowVector& variance) {
  const TwistGain HtW = rows.H.transpose() * variance.cwiseInverse().asDiagonal();
  return (HtW * rows.H).inverse() * HtW;
}

// min over ξ of (z − Hξ)ᵀ W (z − Hξ) = zᵀ P (Pᵀ W⁻¹ P)⁻¹ Pᵀ z.
ResidualTest residual_test(const Rows& rows, const Readings& readings) {
  const Combinations P = left_null_space(rows);
  if (P.cols() == 0) return {};
  const auto misfit = gaussian_misfit(P.transpose() * readings.z.head(rows.measured),
                                      combined_covariance(P, readings.variance));
  return {misfit ? misfit->squared_mahalanobis : std::numeric_limits<double>::infinity(),
          static_cast<int>(P.cols())};
}

Observability observability(const Rows& rows) {
  Observability result;
  const auto [seen, directions] = right_singular_vectors(scaled(rows.H));
  for (int i = 0; i < 3; ++i) {
    if (i < seen.size() && seen[i] > kRankLimit) {
      ++result.rank;
    } else {
      result.unobservable.emplace_back(directions.col(i));
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

}  // namespace trundle::chassis
