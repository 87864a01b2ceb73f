#pragma once

#include <span>
#include <vector>

#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/odometry/rolling.hpp"

namespace trundle::calibration {

/// A stretch of a run between two poses of the reference.
struct Displacement {
  const Run* run = nullptr;
  std::size_t first = 0;  ///< increments
  std::size_t last = 0;
  /// Of the body by the reference, in the frame of its start: x, y, heading.
  Vector3 motion = Vector3::Zero();
  /// Parity residual Pᵀ z of the summed readings: what no motion explains. Empty where there is none, or no
  /// gyro.
  Eigen::VectorXd parity;
  Increment rolled;  ///< |turned| summed, and the duration: what the readings' noise grows with
  Rolling rolling;   ///< at the mean speed: the stretch is cut out of a drive
};

/// From each place of a run to the last one that is at most `stretch_s` later, and on from there.
[[nodiscard]] std::vector<Displacement> displacements(std::span<const Run> runs, const Robot& robot,
                                                      double stretch_s);

/// How the wheels of a robot err: each by itself, or partly all alike, which no parity residual shows.
enum class WheelErrors { independent, partly_alike };

/// Deviance (−2 log likelihood) of the parity residuals: they tell the sensors' levels from each other, and
/// how large they are; of wheels that err partly alike how large they are at least: larger ones are as
/// likely. docs/theory/calibration-noise-displacements.md, eq. 10.
struct ParityDeviance {
  double deviance = 0.0;
  double share = 1.0;  ///< of the levels' variances, that shows in parity residuals
};
[[nodiscard]] ParityDeviance parity_deviance(std::span<const Displacement> displacements, const Robot& robot,
                                             const NoiseLevels& levels, WheelErrors errors);
/// The same of what odometry misses of the displacements, given their parity residuals, which have such a
/// share of its errors. Eq. 9 and 10a.
[[nodiscard]] double displacement_deviance(std::span<const Displacement> displacements, const Robot& robot,
                                           const NoiseLevels& levels, double share);
/// Share of the displacements whose position error lies inside its 95 % ellipse.
[[nodiscard]] double share_inside(std::span<const Displacement> displacements, const Robot& robot,
                                  const NoiseLevels& levels);

}  // namespace trundle::calibration
