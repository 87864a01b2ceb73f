#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/noise/displacements.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {

using Matrix3X = Eigen::Matrix3Xd;

/// What no motion explains in a chassis with or without its gyro, from the geometry alone; of wheels with an
/// encoder that are steered nothing.
struct Redundancy {
  Rows rows;
  Combinations P;
};
[[nodiscard]] Redundancy redundancy_of(const Robot& robot);

/// What odometry errs by and the parity residual of the same readings are independent only where each reading
/// weighs as it errs; a gain weighs them as they err in the mean at a speed, and a wheel that a motion hardly
/// rolls errs less. docs/theory/calibration-noise.md, eq. 10a.
class CommonErrors {
 public:
  /// `showing`: with the noise that parity residuals show. All must outlive it.
  CommonErrors(const Chassis& chassis, const Chassis& showing, const Redundancy& redundancy);

  /// Not where there are no parity residuals, or wheels are steered.
  [[nodiscard]] bool are_known() const { return !gains_.empty(); }
  /// Steps the odometer from the start of a displacement to its end. Returns the covariance of the error of
  /// its pose with Pᵀ Σ z.
  [[nodiscard]] Matrix3X along(const Displacement& displacement, Odometer& odometer) const;

 private:
  /// The white noise of one interval, without rounding.
  RowVector variance_of(const Increment& increment, const Rolled& rolled) const;

  const Chassis& showing_;
  const Redundancy& redundancy_;
  RollingGauge gauge_;
  RowVector rounding_;            ///< variance of one count's
  std::vector<TwistGain> gains_;  ///< by octave of the speed
};

}  // namespace trundle::calibration
