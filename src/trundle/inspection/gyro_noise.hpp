#pragma once

#include <optional>
#include <vector>

#include "trundle/inspection/allan.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::inspection {

/// The gyro at rest: where the wheels (the velocity stream) do not move for at least a second; all of it
/// where neither was recorded.
struct GyroNoise {
  double rest_s = 0.0;  ///< how long altogether
  double bias_rad_s = 0.0;
  double noise_rad_s_sqrt_hz = 0.0;  ///< white density
  double noise_sigma = 0.0;
  std::optional<double> bias_walk_rad_s_sqrt_s;  ///< nothing: the rests are too short and too few
  double bias_walk_limit = 0.0;                  ///< it is below this (95 %)
  bool walk_between_rests = false;               ///< from the means of the rests, not from within them
  std::vector<AllanPoint> allan;
};
/// Nothing when the robot never rests while the gyro runs.
std::optional<GyroNoise> gyro_noise(const Recording& recording);

}  // namespace trundle::inspection
