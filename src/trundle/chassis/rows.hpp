#pragma once

#include <utility>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/chassis.hpp"

namespace trundle::chassis {

/// Rolling rows, lateral rows, the gyro's and those of a bridged interval.
inline constexpr int kMaxRows = 2 * kMaxWheels + 4;

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, kMaxRows, 3>;
using RowVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxRows, 1>;

enum class RowKind {
  wheel,
  lateral,
  skid_lateral,
  gyro,
  forward,
  turn,
  unobserved,  ///< a direction of motion that no other row sees: not more than a guess
};

/// What one row of H measures.
struct Row {
  RowKind kind = RowKind::wheel;
  int wheel = -1;  ///< index of the wheel; for a merged lateral row, of the first one

  [[nodiscard]] bool measured() const {
    return kind != RowKind::lateral && kind != RowKind::skid_lateral && kind != RowKind::unobserved;
  }
};

/// H of z = H ξ (docs/theory/chassis.md, eq. 1), measured rows first.
struct Rows {
  std::array<Row, kMaxRows> row{};
  RowMatrix H;
  int measured = 0;

  [[nodiscard]] int count() const { return static_cast<int>(H.rows()); }
};

/// The rows of a chassis. Identical lateral rows (one axle) are merged: they add no information. Steered
/// wheels stand as their reading says; each keeps its own lateral row, for each may be misread.
[[nodiscard]] Rows rows_of(const Chassis& chassis, bool with_gyro);

/// The rows of a chassis whose steered wheels stand as they did in that interval. Where they see no longer
/// all of the motion, a row `unobserved` for each direction that is left says that it was not far.
/// docs/theory/chassis.md, eq. 10.
[[nodiscard]] Rows rows_at(const Chassis& chassis, const Increment& increment, bool with_gyro);

/// 1σ of an unobserved turn [rad/√s]; of a direction of motion that moves the farthest wheel as far.
inline constexpr double kUnobservedTurn = 0.5;

/// The row of a rolling wheel for unit travel, and that of 'does not skid sideways'. docs/theory/chassis.md,
/// eq. 2 to 4.
[[nodiscard]] Vector3 rolling_row(const Wheel& wheel);
[[nodiscard]] Vector3 lateral_row(const Wheel& wheel);

/// z [m, rad] and the variances of its noise, over one interval by itself: with the rounding of both its
/// ends. docs/theory/chassis.md, eq. 5.
struct Readings {
  RowVector z;
  RowVector variance;
};
[[nodiscard]] Readings readings_of(const Chassis& chassis, const Rows& rows, const Increment& increment);

/// Variance of a wheel's travel over a way of that length, without the rounding of counts, and that of 'does
/// not skid sideways' [m²]. docs/theory/chassis.md, eq. 5.
[[nodiscard]] double rolling_variance(const Chassis& chassis, std::size_t wheel, double travel_m);
[[nodiscard]] double lateral_variance(const Chassis& chassis, double mean_travel_m);

/// Mean |travel| of the wheels [m]; without wheels that of the robot.
[[nodiscard]] double mean_travel(const Chassis& chassis, const Increment& increment);

/// Variances that weigh the rows against each other while every wheel rolls `travel_m` in `duration_s`: of
/// the motion, not of a reading, for a reading that weighs itself biases the mean. docs/theory/chassis.md,
/// eq. 6.
[[nodiscard]] RowVector weighing_variances(const Chassis& chassis, const Rows& rows, double travel_m,
                                           double duration_s);

/// Whether that a steered wheel does not skid is what the row says: it is a reading of the wheel's angle.
[[nodiscard]] bool is_of_angle(const Chassis& chassis, const Row& row);

/// Variance of one rounded count [m²]: q²/12. Successive readings share the count between them.
[[nodiscard]] double rounding_variance(const Wheel& wheel);

/// Weighted least squares over one interval: ξ̂ = (Hᵀ W H)⁻¹ Hᵀ W z.
struct TwistEstimate {
  Twist2 twist;
  Matrix3 covariance = Matrix3::Zero();  ///< (Hᵀ W H)⁻¹
};
/// The rows must have rank 3 (see observability()). Unbiased where the variances do not depend on z.
[[nodiscard]] TwistEstimate estimate_twist(const Rows& rows, const Readings& readings);
/// The (Hᵀ W H)⁻¹ Hᵀ W of rows of these variances.
using TwistGain = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxRows>;
[[nodiscard]] TwistGain twist_gain(const Rows& rows, const RowVector& variance);
/// The twist with the rows weighed as at 1 m/s, whatever the readings, and with steered wheels as they stood.
[[nodiscard]] Twist2 twist_of(const Chassis& chassis, const Rows& rows, const Increment& increment);

using Combinations = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxRows, kMaxRows>;
/// P with Pᵀ H = 0 for the measured rows, orthonormal: its columns span what no motion can make them read.
[[nodiscard]] Combinations left_null_space(const Rows& rows);
/// Pᵀ V P: the covariance of Pᵀ z, of the variances V of z.
[[nodiscard]] Combinations combined_covariance(const Combinations& P, const RowVector& variance);

/// What no motion can explain: rᵀ W r of the measured rows alone, χ² distributed when nothing slips.
struct ResidualTest {
  double chi2 = 0.0;
  int degrees_of_freedom = 0;  ///< measured rows − rank of their H
};
[[nodiscard]] ResidualTest residual_test(const Rows& rows, const Readings& readings);

/// What the sensors of a chassis can and cannot determine, in words and as numbers.
struct Observability {
  int rank = 0;
  int degrees_of_freedom = 0;         ///< of the slip test
  std::vector<Vector3> unobservable;  ///< directions of twist no row sees, turn scaled by the robot's size
  /// Pairs of measured rows whose errors look alike; none is listed where there is no degree of freedom at
  /// all.
  std::vector<std::pair<int, int>> confusable;
  /// Measured rows that no other one checks: an error of theirs leaves no residual.
  std::vector<int> undetectable;
};
[[nodiscard]] Observability observability(const Rows& rows);

}  // namespace trundle::chassis
