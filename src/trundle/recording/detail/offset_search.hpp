#pragma once

#include <optional>

#include "trundle/recording/detail/comparer.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {

/// The offset at which fixed = a · moved + b · duration + residual leaves least, in all channels together,
/// each with its own a, b and noise; windows with a residual that no noise explains (slip) are left out. σ
/// has the scatter of the residuals, which may hang together over some windows [Newey & West 1987]. Nothing
/// where hardly a window is left, the sensors do not speak of the same motion, or σ is too large.
[[nodiscard]] std::optional<TimeOffset> find_offset(ClockComparison comparison);

}  // namespace trundle::recording
