#pragma once

#include <optional>

#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

/// How far two robots' odometry of one run is from its reference, both laid on it as well as can be.
struct HeldOutErrors {
  double given_m2 = 0.0;       ///< mean square of the position error [m²]
  double calibrated_m2 = 0.0;  ///< the same with the other robot
  /// Mean of e·(e − e_given) [m²], e the calibrated robot's position error: > 0 where a step back to the
  /// given one makes it smaller. Of a calibrated robot without fault its mean is 0.
  double pull_m2 = 0.0;
  double pull_variance_m4 = 0.0;  ///< of the noise of the calibrated robot's readings and of the reference's

  void add(const HeldOutErrors& other);
};

/// Nothing without positions to compare. Of the bias of its gyro a run that was left out knows what its rests
/// show. docs/theory/calibration-uncertainty.md, eq. 15.
[[nodiscard]] std::optional<HeldOutErrors> held_out_errors(const Run& run, const Robot& given,
                                                           const Robot& calibrated,
                                                           const ReferenceNoise& reference,
                                                           bool learn_gyro_bias);

}  // namespace trundle::calibration
