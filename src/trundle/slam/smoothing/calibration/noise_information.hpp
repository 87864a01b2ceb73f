#pragma once

#include <Eigen/Core>

#include "trundle/slam/smoothing/solver/minimise.hpp"

namespace trundle::slam {

/// What noise in the motions' sensitivities makes of the information about a problem's first n parameters, in
/// the mean, each parameter against each: of sensitivities that correct_readings() has corrected, at the
/// state at which the problem was linearised then. docs/theory/landmark-calibration.md, eq. 13e.
[[nodiscard]] Eigen::MatrixXd noise_information(const SmoothingProblem& problem, const SmoothingState& state,
                                                const Minimiser& linearised, Eigen::Index n);

}  // namespace trundle::slam
