#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

struct LearnNoiseOptions {
  double stretch_s = 2.0;  ///< over which errors are made consistent: runs are cut into stretches of it
  bool per_wheel = true;   ///< wheels may differ, where the displacements distinguish them
};

/// The noise of one wheel, where wheels were distinguished [m/√m].
struct WheelNoise {
  double per_sqrt_m = 0.0;
  double sigma = 0.0;
};

/// The noise levels of a calibrated robot that make what odometry misses of the reference over short
/// stretches most likely.
struct LearnedNoise {
  NoiseLevels levels;
  /// Of each wheel; empty: the displacements do not distinguish them, or they are alike.
  std::vector<WheelNoise> wheels = {};
  int displacements = 0;   ///< that they were learned from
  double inside_95 = 0.0;  ///< share of those whose position error lies inside the 95 % ellipse
  std::string how = {};    ///< for the robot file
};

/// Maximum likelihood; each wheel's own level where that is likelier than one for all beyond chance.
/// docs/theory/calibration-noise-displacements.md, eq. 9 to 11. Throws CannotAnswer with fewer than 20
/// displacements that have a pose at both ends.
[[nodiscard]] LearnedNoise learn_noise(std::span<const Run> runs, const Robot& robot,
                                       const LearnNoiseOptions& options = {});

/// The same; nothing with fewer.
[[nodiscard]] std::optional<LearnedNoise> learn_noise_if_possible(std::span<const Run> runs,
                                                                  const Robot& robot,
                                                                  const LearnNoiseOptions& options = {});

}  // namespace trundle::calibration
