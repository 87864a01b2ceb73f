#pragma once

#include <cstddef>
#include <optional>

#include "trundle/chassis/chassis.hpp"

namespace trundle::chassis {

/// The chassis without one of its wheels, and what it would have read: what the others say of that one.
[[nodiscard]] Chassis without_wheel(const Chassis& chassis, std::size_t wheel);
[[nodiscard]] Increment without_wheel(const Increment& increment, std::size_t wheel);

/// The chassis without the passive wheels that are steered, for those who need one H for all time. Nothing
/// where a wheel with an encoder is steered.
[[nodiscard]] std::optional<Chassis> without_steering(const Chassis& chassis);

}  // namespace trundle::chassis
