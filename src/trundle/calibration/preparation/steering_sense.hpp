#pragma once

#include <span>
#include <vector>

#include "trundle/calibration/problem/run.hpp"

namespace trundle::calibration {

/// Wheels whose readings go against the motion that a reference with headings shows, or else wheels that are
/// not steered: indices as in Chassis::all_wheels().
struct ReversedWheels {
  std::vector<std::size_t> steerings;  ///< whose angles count clockwise
  std::vector<std::size_t> counters;   ///< of steered robots, of all wheels with an encoder
};
[[nodiscard]] ReversedWheels reversed_wheels_of_steered(std::span<const Run> runs, const Robot& robot);

}  // namespace trundle::calibration
