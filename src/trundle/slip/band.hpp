#pragma once

#include <span>

#include "trundle/slip/normality.hpp"

namespace trundle::slip {

/// Where δ = (dR − dL)/B − g lies when nothing slips, and under which conditions that was learned.
/// docs/theory/slip-published.md, eq. 4.
struct Band {
  double lower = 0.0;  ///< [rad]
  double upper = 0.0;
  double probability = 0.0;  ///< that δ lies outside although nothing slips
  double interval_s = 0.0;
  double least_speed_m_s = 0.0;  ///< of the robot, either way
  double greatest_speed_m_s = 0.0;
  bool empirical = false;      ///< quantiles of the sample, which is not normal
  bool beyond_sample = false;  ///< and the sample is too small for them: it is its whole range
  NormalityTest normality = {};

  bool contains(double delta) const { return delta >= lower && delta <= upper; }
  /// Speeds and lengths of interval that differ more are another population.
  bool holds_for(double duration_s, double speed_m_s) const;
};

/// μ ± z σ of a sample whose moments are taken for the truth.
Band known_band(const Moments& moments, double z);

/// The band that holds the next δ with probability 1 − p: Student's prediction interval where the sample is
/// normal, else its own quantiles. Interval and speeds are left to the caller.
/// Throws CannotAnswer below 8 values, or where all are equal.
Band learn_band(std::span<const double> sample, double probability, double significance = 0.1);

/// The share 1 − p of a sample is at most this; `beyond_sample`: p is less than one value's share.
double upper_quantile(std::span<const double> sorted, double p, bool& beyond_sample);

}  // namespace trundle::slip
