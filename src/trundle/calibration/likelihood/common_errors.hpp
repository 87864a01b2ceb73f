#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/rows.hpp"
#include "trundle/odometry/rolling.hpp"

namespace trundle::calibration {

/// Covariance of a motion's error (rows, body axes) with that of parity residuals Pᵀz (columns).
using CommonError = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMaxRows>;

/// What odometry errs by and the parity residual of the same readings are independent only where each reading
/// weighs as it errs; a gain weighs them as they err in the mean at a speed, and a wheel that a motion hardly
/// rolls errs less: G V P. docs/theory/calibration-noise-displacements.md, eq. 10a. Of wheels that are not
/// steered.
class CommonErrors {
 public:
  /// `showing`: with the noise that parity residuals show, and outliving it. P: of the rows' left null space.
  CommonErrors(const Chassis& chassis, const Chassis& showing, const Rows& rows, const Combinations& P);

  /// The ways that became sure in an interval.
  [[nodiscard]] Rolled rolled(Rolling& rolling, const Increment& increment) const {
    return gauge_.add(rolling, increment);
  }
  /// Of an interval, without rounding, weighed as in that octave of the speed.
  [[nodiscard]] CommonError of(double duration_s, const Rolled& rolled, std::size_t octave) const;
  /// Of the rounding of one count of each wheel.
  [[nodiscard]] CommonError of_rounding(std::size_t octave) const;

 private:
  [[nodiscard]] CommonError of(const RowVector& variance, std::size_t octave) const;

  const Chassis& showing_;
  Rows rows_;
  Combinations P_;
  RollingGauge gauge_;
  RowVector rounding_;            ///< variance of one count's
  std::vector<TwistGain> gains_;  ///< by octave of the speed
};

}  // namespace trundle::calibration
