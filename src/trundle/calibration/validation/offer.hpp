#pragma once

#include <vector>

#include "trundle/calibration/problem/problem.hpp"
#include "trundle/calibration/result.hpp"

namespace trundle::calibration {

/// What each of these parameters would gain on runs from which it is not learned: of runs each by all others,
/// of a single one each half by the other. Those that gain significantly. docs/theory/scrub.md, eq. 6 and 7.
[[nodiscard]] std::vector<ParameterOffer> offers_of(const CalibrationProblem& problem,
                                                    std::span<const Parameter> parameters);

}  // namespace trundle::calibration
