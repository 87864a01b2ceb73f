#pragma once

#include <Eigen/Core>

#include "trundle/chassis/chassis.hpp"

namespace trundle::calibration {

/// How a gyro's bias walks about its mean over a recording, as its Karhunen-Loève series: harmonics
/// cos(kπ t/T), whose amplitudes are independent with 1σ w √(2T)/(kπ). As many as rise above the gyro's white
/// noise. docs/theory/landmark-calibration.md, eq. 13f.
struct BiasWalk {
  double start_s = 0.0;
  double duration_s = 0.0;     ///< T
  double walk = 0.0;           ///< w [rad/s/√s]
  Eigen::Index harmonics = 0;  ///< none: the bias hardly walks

  /// Each harmonic's 1σ at a time [rad/s].
  [[nodiscard]] Eigen::RowVectorXd at(double time_s) const;
};

/// Over a recording that lasts from one time to another.
[[nodiscard]] BiasWalk bias_walk_of(const Gyro& gyro, double start_s, double end_s);

}  // namespace trundle::calibration
