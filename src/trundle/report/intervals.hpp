#pragma once

#include <optional>
#include <utility>

#include "trundle/calibration/result.hpp"

namespace trundle::report {

/// Lower and upper end, in the unit of the parameter.
using Interval = std::pair<double, double>;

/// Where the parameter lies by the noise of these runs alone: value ± 1.96 σ_w. Nothing for a held one.
std::optional<Interval> interval95_within(const ParameterEstimate& estimate);

/// Where a further session of this robot is expected: value ± t_{k−1} √(s_b² (1 + 1/k) + σ_w²).
/// Nothing for a held parameter, and where the spread from session to session is unknown.
std::optional<Interval> interval95_between(const ParameterEstimate& estimate, int sessions);

}  // namespace trundle::report
