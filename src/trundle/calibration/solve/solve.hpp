#pragma once

#include "trundle/calibration/likelihood/likelihood.hpp"
#include "trundle/calibration/solve/observability.hpp"
#include "trundle/statistics/descent.hpp"

namespace trundle::calibration {

/// Maximum likelihood by Gauss–Newton from where the robot is, in the space that the runs can determine;
/// without prior. docs/theory/calibration.md, eq. 6.
Descent solve(const Likelihood& likelihood, const EstimableSpace& space, Robot& robot);

/// Maximum a posteriori from where the robot is, of all parameters: the prior keeps there what is not seen. A
/// first rough estimate from anywhere near nominal.
void approach(const Likelihood& likelihood, Robot& robot);

}  // namespace trundle::calibration
