#pragma once

#include <functional>
#include <optional>

#include "trundle/recording/detail/comparer.hpp"
#include "trundle/recording/time_offset.hpp"

namespace trundle::recording {

/// The offset at which fixed = a · moved + b · duration + residual leaves least, in all channels together,
/// each with its own a, b and noise; windows with a residual that no noise explains (slip) are left out. σ
/// has the scatter of the residuals, which may hang together over some windows [Newey & West 1987]. Nothing
/// where hardly a window is left, the sensors do not speak of the same motion, or σ is too large.
[[nodiscard]] std::optional<TimeOffset> find_offset(ClockComparison comparison);

/// The same where what is moved is noisy, and its noise moves with the offset: `smoothed_over` gives it with
/// every value the mean of those within so long [s] about it. 2, 1, 0.5 or 0 s: the longest that leaves no
/// more, by a sigma, of what is fixed, which knows nothing of that noise. docs/theory/sensor-clock.md, eq. 2.
/// Nothing where it gives nothing.
[[nodiscard]] std::optional<TimeOffset> find_offset_of_noisy(
    const std::function<std::optional<ClockComparison>(double over_s)>& smoothed_over);

}  // namespace trundle::recording
