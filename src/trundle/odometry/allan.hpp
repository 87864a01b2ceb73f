#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::odometry {

/// Allan deviation at one averaging time.
struct AllanPoint {
  double tau_s = 0.0;
  double deviation = 0.0;           ///< in the unit of the samples
  double degrees_of_freedom = 0.0;  ///< of its variance, roughly
};

/// Overlapping Allan deviation of stretches of samples `step_s` apart, pooled over them; averaging times are
/// step_s · 1, 2, 4, ... as far as three degrees of freedom remain. docs/theory/gyro.md, eq. 9.
std::vector<AllanPoint> allan_deviation(std::span<const std::vector<double>> stretches, double step_s);

/// White noise and a random walk, from the Allan deviation.
struct NoiseFit {
  double density = 0.0;  ///< N: [unit/√Hz]
  double density_sigma = 0.0;
  std::optional<double> walk;  ///< K: [unit/√s]; nothing: the record is too short to tell it from zero
  double walk_sigma = 0.0;     ///< where there is one
  double walk_limit = 0.0;     ///< K is below this (95 %)
};
/// Weighted fit of σ²(τ) = N²/τ + K² τ/3. docs/theory/gyro.md, eq. 10. Nothing with fewer than two points.
std::optional<NoiseFit> fit_noise(std::span<const AllanPoint> points);

}  // namespace trundle::odometry
