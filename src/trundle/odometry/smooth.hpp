#pragma once

#include <array>
#include <vector>

#include "trundle/odometry/odometer.hpp"

namespace trundle::odometry {

/// Pose and gyro bias after a step, with their covariance, and how the step made them.
struct FilteredStep {
  Pose2 pose;
  Symmetric3 white{};            ///< of the pose, in world axes
  std::array<double, 3> bias{};  ///< covariance of pose and bias
  GyroBias gyro_bias;
  StepTrace trace;
};

[[nodiscard]] FilteredStep filtered_step(const Odometer& odometer);

/// Fixed-interval smoothing: every pose and bias by all that was learned before and after it, in place. The
/// first step's trace is not used. `prior_rad_s`: from the first step's bias, which the motion is linearised
/// about, to the one that was expected; where that is 0 the last step does not change. docs/theory/gyro.md,
/// eq. 6 to 8.
void smooth(std::vector<FilteredStep>& steps, double prior_rad_s);

}  // namespace trundle::odometry
