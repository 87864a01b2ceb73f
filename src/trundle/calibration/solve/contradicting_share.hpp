#pragma once

#include <optional>

#include "trundle/calibration/likelihood/likelihood.hpp"

namespace trundle::calibration {

/// How large that is which no motion explains of the runs' readings: Likelihood::contradicting_share, and
/// where all of the noise makes less of it than there is, Likelihood::redundancy_factor.
/// docs/theory/calibration-noise.md, eq. 8e.
struct ContradictingShare {
  double share = 1.0;   ///< at most 1
  double factor = 1.0;  ///< at least 1, and 1 where less than all is seen
};

/// By windows so long. Nothing where runs are too short for them, or motion explains whatever is read.
[[nodiscard]] std::optional<ContradictingShare> contradicting_share(const Likelihood& likelihood,
                                                                    const Robot& robot, double window_s);

}  // namespace trundle::calibration
