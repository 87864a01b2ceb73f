#pragma once

#include <optional>
#include <span>
#include <string>

#include "trundle/recording/time_offset.hpp"

namespace trundle::calibration {

/// What one recording says of the lag.
using LagOf = std::optional<TimeOffset> (*)(const Recording& recording, const Robot& robot);

/// Sets by how much the motion lags behind a velocity, where most of the recordings that can tell it do, and
/// clocks that were set without it. `shown_by`: in words. Returns what was done, in words; nothing: it stays
/// as it is.
std::optional<std::string> set_velocity_lag(std::span<const Recording> recordings, LagOf lag_of,
                                            const char* shown_by, Robot& robot);

/// Whether all of a velocity is to stay as it is given, its lag too: `--fix velocity`.
[[nodiscard]] bool fixes_velocity(std::span<const std::string> fixed);

}  // namespace trundle::calibration
