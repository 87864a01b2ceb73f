#pragma once

#include <algorithm>

#include "trundle/chassis/chassis.hpp"

namespace trundle::inspection {

/// Whether the robot goes nowhere but where its wheels roll: beside omni and mecanum wheels, which are pushed
/// along their rollers, one may stand while all others turn.
[[nodiscard]] inline bool all_roll_ahead(const Chassis& chassis) {
  return !chassis.wheels().empty() && std::ranges::none_of(chassis.wheels(), has_rollers, &Wheel::kind);
}

}  // namespace trundle::inspection
