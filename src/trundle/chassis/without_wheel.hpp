#pragma once

#include <cstddef>

#include "trundle/chassis/chassis.hpp"

namespace trundle::chassis {

/// The chassis without one of its wheels, and what it would have read: what the others say of that one.
[[nodiscard]] Chassis without_wheel(const Chassis& chassis, std::size_t wheel);
[[nodiscard]] Increment without_wheel(const Increment& increment, std::size_t wheel);

}  // namespace trundle::chassis
