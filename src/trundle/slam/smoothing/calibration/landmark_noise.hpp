#pragma once

#include <span>
#include <string>
#include <vector>

#include "trundle/slam/smoothing/calibration/landmark_fit.hpp"
#include "trundle/slam/smoothing/calibration/lasting_errors.hpp"

namespace trundle::slam {

/// One noise of a robot, as its file has it.
struct NoiseLevel {
  std::string name;            ///< of its key, with the table: "noise.wheel_per_sqrt_m"
  double given = 0.0;          ///< [the key's unit]
  double value = 0.0;          ///< equal to `given` where it is not determined
  double sigma = 0.0;          ///< of `value`
  double redundancy = 0.0;     ///< readings behind it, less those that poses, map and parameters took
  bool is_determined = false;  ///< false: the sightings leave it open by more than half of itself
};

/// Noises that make the residuals of a smoother most likely.
struct LandmarkNoise {
  Robot robot;  ///< with them
  std::vector<NoiseLevel> levels;
  std::vector<LastingError> lasting;  ///< those beyond chance
};

/// The variance components of ranges, bearings and odometry by restricted maximum likelihood, from what the
/// smoother leaves of sightings and motions at a fit's minimum, near those of `given` if they show little;
/// what cannot be determined stays as there. The search starts from the fit's own.
/// docs/theory/landmark-noise.md.
[[nodiscard]] LandmarkNoise learn_landmark_noise(std::span<const AssociatedRecording> all,
                                                 const LandmarkFit& fit, const Robot& given);

/// A robot with the noises of another one like it.
[[nodiscard]] Robot with_noise_of(const Robot& noisy, Robot robot);

}  // namespace trundle::slam
