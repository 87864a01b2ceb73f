#pragma once

#include "trundle/evaluation/evaluate.hpp"

namespace trundle::evaluation {

/// How far the estimate of a pair is from its reference; its heading wrapped, NaN where none was measured.
double position_error(const PosePair& pair);
double heading_error(const PosePair& pair);
bool has_heading(const PosePair& pair);

/// 3 where every reference has a heading, else 2.
int degrees_of_freedom(const std::vector<PosePair>& pairs);

/// Metres along the reference from its first pose, in steps long enough not to count noise as way.
std::vector<double> way_along(const std::vector<PosePair>& pairs, double shortest_step_m);

/// eᵀ Σ⁻¹ e of the first `dof` of (x, y, heading); nothing when Σ is not positive definite.
std::optional<double> normalised_error(const PosePair& pair, int dof);

}  // namespace trundle::evaluation
