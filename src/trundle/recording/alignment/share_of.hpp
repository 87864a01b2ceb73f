#pragma once

#include "trundle/chassis/chassis.hpp"

namespace trundle::recording {

/// What was read in a share of an interval's time, were all of it read evenly. Its stamp stays.
[[nodiscard]] inline Increment share_of(Increment increment, double share) {
  increment.duration_s *= share;
  increment.gyro_rad *= share;
  increment.gyro_change_rad_s *= share;
  increment.scrub_turned *= share;
  for (double& turned : increment.turned) turned *= share;
  for (double& turned : increment.speed_turned) turned *= share;
  for (double& variance : increment.slip_variance) variance *= share;
  return increment;
}

}  // namespace trundle::recording
