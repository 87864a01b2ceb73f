#pragma once

#include <optional>
#include <span>

#include "trundle/calibration/run_likelihood.hpp"

namespace trundle {

/// How noisy the runs themselves show odometry and reference to be.
struct NoiseEstimate {
  double wheel_per_sqrt_m = 0.0;
  ReferenceNoise reference;
  bool from_runs = false;                     ///< false: too little reference, the robot file's numbers stand
  std::optional<ChassisNoise> sideways = {};  ///< lateral and skid noise, where they were learned
  double gyro_factor = 1.0;  ///< by which the gyro's noise is larger than the robot file says
};

/// Separates odometry's noise from the reference's by how the difference of their headings grows along a run:
/// the variance over a lag s is 2 σ_heading² + (rate of odometry noise) · s. What is alike at all lags (body
/// wobble, tracking) is the reference's; only what grows is the wheels'. Where a gyro tells the heading, its
/// growth says nothing of the wheels: theirs is then that of the position. The reference's position noise is
/// what makes the innovations consistent. docs/theory/calibration-noise.md, eq. 8. `robot` should already be
/// calibrated roughly.
NoiseEstimate estimate_noise(std::span<const Run> runs, const Robot& robot);

/// The robot with that noise, and without counting the rounding of counts as noise of every interval:
/// rounding errors of successive increments cancel.
Robot with_noise(const Robot& robot, const NoiseEstimate& noise);
/// The robot with the noise that its wheels' readings have at nominal diameters [m/√m]: a diameter makes a
/// reading and its error larger alike, so that no wheel is made small to make its errors small.
Robot with_noise_of_readings(const Robot& robot, const Chassis& nominal);

}  // namespace trundle
