#pragma once

#include <optional>
#include <span>

#include "trundle/calibration/run.hpp"

namespace trundle::calibration {

/// How the differences of reference and free-running odometry grow along runs: the variance over a lag s is
/// 2 σ² + q s. What is alike at all lags (body wobble, tracking) is the reference's; what grows is the
/// odometry's. A moment estimate, robust and of long lags. docs/theory/calibration-noise.md, eq. 8.
struct Growth {
  double odometry = 1.0;         ///< σ of what is seen to grow, over that of the robot's noise
  double possible = 1.0;         ///< the same of what may grow (mean of what is not negative): never nothing
  double reference_sigma = 0.0;  ///< of what is alike at all lags [m] or [rad]
};

/// Of the heading. Nothing where runs are too short or too few.
[[nodiscard]] std::optional<Growth> growth_of_heading(std::span<const Run> runs, const Robot& robot);

/// 1σ of what headings are known by.
struct HeadingNoise {
  double gyro_rad_s_sqrt_hz = 0.0;
  double reference_rad = 0.0;
};
/// Of x and y together, of a robot whose gyro the model takes for perfect: what its headings walk is taken
/// out of them as the reference's show it, or it would pass for noise of the wheels. Nothing as above.
[[nodiscard]] std::optional<Growth> growth_of_position(std::span<const Run> runs, const Robot& robot,
                                                       const HeadingNoise& noise);

/// Whether runs have so many reference epochs that lags differ.
[[nodiscard]] bool have_lags(std::span<const Run> runs);

}  // namespace trundle::calibration
