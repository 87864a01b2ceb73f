#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "trundle/calibration/run.hpp"

namespace trundle {

struct LearnNoiseOptions {
  double piece_s = 2.0;   ///< runs are cut into pieces of this length: errors over that time are made honest
  bool per_wheel = true;  ///< wheels may differ, where the pieces tell them apart
};

/// The noise of one wheel, where wheels were told apart.
struct WheelNoise {
  double per_sqrt_m = 0.0;
  double sigma = 0.0;
};

/// How noisy the readings of a calibrated robot are, by what odometry misses of the reference over short
/// pieces.
struct LearnedNoise {
  ChassisNoise noise;              ///< wheel (typical), and lateral or skid; the rest as it was
  std::vector<WheelNoise> wheels;  ///< of each; empty: the pieces do not tell them apart, or they are alike
  std::optional<double> gyro_rad_s_sqrt_hz;  ///< with a gyro
  double reference_position_m = 0.0;         ///< of each reference pose
  double reference_heading_rad = 0.0;
  int pieces = 0;
  double inside_95 = 0.0;  ///< share of the pieces whose position error lies inside the 95 % ellipse
  std::string how;         ///< for the robot file
};

/// The noise that makes those errors most likely; each wheel's own where that is beyond doubt likelier than
/// one for all. docs/theory/calibration-noise.md, eq. 9 to 11. Throws CannotAnswer with fewer than 20 pieces
/// that have a pose at both ends.
LearnedNoise learn_noise(std::span<const Run> runs, const Robot& robot,
                         const LearnNoiseOptions& options = {});

/// The same; nothing with fewer pieces.
std::optional<LearnedNoise> learn_noise_if_possible(std::span<const Run> runs, const Robot& robot,
                                                    const LearnNoiseOptions& options = {});

/// The robot with that noise.
Robot with_learned_noise(const Robot& robot, const LearnedNoise& learned);

}  // namespace trundle
