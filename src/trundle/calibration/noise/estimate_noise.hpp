#pragma once

#include <span>

#include "trundle/calibration/noise/noise_levels.hpp"
#include "trundle/calibration/run.hpp"

namespace trundle::calibration {

/// How noisy the runs themselves show odometry and reference to be.
struct NoiseEstimate {
  NoiseLevels levels;
  bool from_runs = false;  ///< false: too little reference, the robot file's numbers stand
};

/// The one estimate of the variance components. Where runs are long, by the growth of differences: what is
/// alike at all lags is the reference's, what grows is the wheels'; where a gyro shows the heading, its
/// growth says nothing of the wheels, theirs is then that of the position, and the heading's is the gyro's
/// (growth.hpp, eq. 8). Where they are too short for lags, by the likelihood of displacements
/// (learn_noise.hpp, eq. 9 and 10). The reference's position noise is what makes the innovations consistent.
/// docs/theory/calibration-noise.md. `robot` should already be calibrated roughly.
[[nodiscard]] NoiseEstimate estimate_noise(std::span<const Run> runs, const Robot& robot);

}  // namespace trundle::calibration
