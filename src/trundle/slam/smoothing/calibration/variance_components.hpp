#pragma once

#include <span>
#include <vector>

#include "trundle/slam/smoothing/solver/minimise.hpp"

namespace trundle::slam {

/// How the variances V of a problem's residuals change with one noise of variance σ²: D = ∂V/∂ log σ².
struct NoiseDerivative {
  Vector2 of_reading = Vector2::Zero();  ///< of a sighting (range, bearing), as a share of its variance
  std::vector<Matrix3> of_motions = {};  ///< by motion link; empty: none depends on it
};

/// What the residuals of a minimum say of noises, each by log σ². docs/theory/landmark-noise.md, eq. 17
/// to 19.
struct ComponentEvidence {
  Eigen::VectorXd score;        ///< ∂(log restricted likelihood)
  Eigen::MatrixXd information;  ///< average of the observed and the expected [Gilmour et al. 1995]
  Eigen::VectorXd redundancy;   ///< so many residuals are left to each noise by what was estimated
};

/// At a state at which `linearised` was linearised. Of problems without a bias beside their poses.
[[nodiscard]] ComponentEvidence component_evidence(const SmoothingProblem& problem,
                                                   const SmoothingState& state, const Minimiser& linearised,
                                                   std::span<const NoiseDerivative> noises);

}  // namespace trundle::slam
