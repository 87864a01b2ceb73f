#pragma once

#include <optional>
#include <span>

#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// How the differences of the reference's headings and those of free-running odometry grow along runs: the
/// variance over a lag s is 2 σ² + q s. What is alike at all lags (body wobble, tracking) is the reference's;
/// what grows is the odometry's. A moment estimate, robust and of long lags.
/// docs/theory/calibration-noise.md, eq. 8.
struct Growth {
  double odometry = 1.0;         ///< σ of what is seen to grow, over that of the robot's noise
  double possible = 1.0;         ///< the same of what may grow (mean of what is not negative): never nothing
  double reference_sigma = 0.0;  ///< of what is alike at all lags [rad]
};

/// Nothing where runs are too short or too few. `fitted`: the parameters that the robot was fitted to the
/// runs by, which took their share of what grows.
[[nodiscard]] std::optional<Growth> growth_of_heading(std::span<const Run> runs, const Robot& robot,
                                                      std::span<const Parameter> fitted);

}  // namespace trundle::calibration
