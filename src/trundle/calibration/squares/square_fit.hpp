#pragma once

#include <Eigen/Core>

#include "trundle/calibration/squares/square.hpp"

namespace trundle::calibration {

enum class SquareMethod {
  classic,      ///< from positions: Borenstein & Feng's UMBmark
  orientation,  ///< from headings and the measured leg
  ml,           ///< maximum likelihood of everything on the sheet
};

/// What is measured on a sheet: x, y, heading error of the mean cw run, those of the mean ccw run, the leg
/// [m, rad].
inline constexpr int kSquareReadings = 7;
using SquareVector = Eigen::Matrix<double, kSquareReadings, 1>;
using SquareMatrix = Eigen::Matrix<double, kSquareReadings, kSquareReadings>;

/// Means of a sheet and what their scatter says of them.
struct SquareStatistics {
  SquareMeans means;
  /// Of the means. Widened so that ±1.96 σ holds 95 % in spite of the few runs: factor (t/1.96)².
  SquareMatrix covariance = SquareMatrix::Zero();
  /// What `ml` weighs them with: the same without correlations that too few runs cannot show, with a floor.
  SquareMatrix weight = SquareMatrix::Zero();
  int degrees_of_freedom = 0;  ///< of the scatter of the runs; 0: assumed
  int legs = 0;                ///< how many runs have a leg; with 1 its error is assumed
};
SquareStatistics statistics_of(const SquareSheet& sheet);

/// The scatter that is assumed where a single run of each sense shows none, and for a leg measured once.
inline constexpr double kAssumedPositionSigmaInSides = 0.01;
inline constexpr double kAssumedHeadingSigmaRad = radians(1.0);
inline constexpr double kAssumedLegSigmaM = 0.005;

/// How far from nominal a diameter and a track may plausibly be, 1σ (chassis/parameter.hpp: prior_sigma).
inline constexpr double kDiameterPriorShare = 0.05;
inline constexpr double kTrackPriorShare = 0.2;

/// The drive that explains a sheet.
struct SquareFit {
  SidedDrive drive;
  Matrix3 covariance =
      Matrix3::Zero();    ///< of (left diameter, right diameter, track); given the mean if it is held
  bool mean_held = true;  ///< the mean diameter is nominal, not measured
  double mean_sigma_data_m = 0.0;  ///< what the sheet says of the mean diameter; infinite: nothing
  /// Of the whitened Jacobian of what the method uses, scaled by prior sigmas; largest first, with its
  /// directions.
  Vector3 singular_values = Vector3::Zero();
  Matrix3 directions = Matrix3::Zero();
};

/// Throws CannotAnswer when no robot explains the errors. docs/theory/umbmark.md, eq. 13 and 14.
SquareFit fit_square(const SquareStatistics& statistics, double side_m, const SidedDrive& nominal,
                     SquareMethod method);

}  // namespace trundle::calibration
