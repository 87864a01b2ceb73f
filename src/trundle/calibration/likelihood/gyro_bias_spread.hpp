#pragma once

#include <functional>

#include "trundle/calibration/likelihood/likelihood.hpp"

namespace trundle::calibration {

/// How far the gyro's bias of a run is, 1σ, from the one that runs share [rad/s]: a variance component beside
/// those of noise/, found by restricted maximum likelihood. docs/theory/calibration-runs.md, eq. 6c. 0: one
/// run alone has a gyro.
struct GyroBiasSpread {
  double found_rad_s = 0.0;  ///< as the runs show it; 0: not at all
  /// For the prior of each run's bias. Where runs say little of it, it is the robot file's, and never less
  /// than runs could hide.
  double prior_rad_s = 0.0;
};
[[nodiscard]] GyroBiasSpread gyro_bias_spread(const Likelihood& likelihood, const Robot& robot);

/// By what −2 log of the restricted likelihood is with a spread; `given_rad_s`: the robot file's.
[[nodiscard]] GyroBiasSpread most_likely_spread(double given_rad_s,
                                                const std::function<double(double spread_rad_s)>& deviance);

/// What is taken for it before the runs were looked at: that of the robot file.
[[nodiscard]] double given_gyro_bias_spread(const CalibrationProblem& problem);

}  // namespace trundle::calibration
