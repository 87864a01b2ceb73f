#pragma once

#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"

namespace trundle::chassis {

/// What the turn of a wheel amounts to on the ground: linear in what an increment read. docs/theory/scrub.md,
/// eq. 4, and docs/theory/tyre-growth.md, eq. 3.
[[nodiscard]] inline double ground_turned(const Chassis& chassis, std::size_t wheel,
                                          const Increment& increment) {
  double turned = increment.turned[wheel];
  if (chassis.scrub != 0.0) turned -= chassis.scrub * scrub_sides(chassis)[wheel] * increment.scrub_turned;
  if (chassis.tyre_growth_s2_m2 != 0.0) turned += growth_of(chassis, wheel) * increment.speed_turned[wheel];
  return turned;
}

}  // namespace trundle::chassis
