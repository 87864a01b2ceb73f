#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/chassis/chassis.hpp"
#include "trundle/odometry/allan.hpp"
#include "trundle/recording/recording.hpp"

namespace trundle::odometry {

/// The gyro at rest: where the wheels (the velocity stream) do not move for at least a second; all of it
/// where neither was recorded.
struct GyroNoise {
  double rest_s = 0.0;  ///< how long altogether
  double bias_rad_s = 0.0;
  double noise_rad_s_sqrt_hz = 0.0;  ///< white density
  double noise_sigma = 0.0;
  double rounding_rad_s_sqrt_hz = 0.0;  ///< the most of it that may be due to the resolution of its readings
  std::optional<double> bias_walk_rad_s_sqrt_s;  ///< nothing: the rests are too short and too few
  double bias_walk_limit = 0.0;                  ///< it is below this (95 %)
  bool walk_between_rests = false;               ///< from the means of the rests, not from within them
  std::vector<AllanPoint> allan;

  /// Of the density's square, whose relative variance is 2 over it. 0: no noise shows.
  double degrees_of_freedom() const;
};
/// Nothing when the robot never rests while the gyro runs. `gyro_later_s`: what is added to the gyro's stamps
/// for them to be those of the wheels; `lag_s`: of the motion behind a velocity. A rest in which the gyro
/// scatters twice as much as in most of them is none: somebody pushes the robot, or carries it away.
std::optional<GyroNoise> gyro_noise(const Recording& recording, double gyro_later_s = 0.0,
                                    double lag_s = 0.0);
/// With the clocks of this robot; nothing where neither wheels nor a velocity say that it rests.
std::optional<GyroNoise> gyro_noise(const Recording& recording, const Chassis& chassis);

/// Whether it is more than a gyro of that density shows by chance, once in a thousand times, its readings
/// rounded as they are. docs/theory/gyro.md, eq. 11.
bool is_louder(const GyroNoise& noise, double density);

/// That of several recordings together, each with the weight of its degrees of freedom: density, sigma,
/// rounding and duration of the rests. `all` has at least one.
GyroNoise pooled(std::span<const GyroNoise> all);

}  // namespace trundle::odometry
