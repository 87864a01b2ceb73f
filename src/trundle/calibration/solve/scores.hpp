#pragma once

#include <vector>

#include "trundle/calibration/likelihood/likelihood.hpp"
#include "trundle/calibration/solve/observability.hpp"

namespace trundle::calibration {

/// What one run contributed to an estimate.
struct RunEvidence {
  double weight = 1.0;        ///< below 1: down-weighted, it pulls the parameters away from all others
  double chi2_per_dof = 0.0;  ///< of its score; 1 is expected
  std::vector<OutlyingEpoch> outliers;
  Information information;  ///< about the parameters, at the estimate; times the weight
};

/// Weights of runs from their score statistics, compared with the typical run's (Huber).
/// docs/theory/calibration-uncertainty.md.
[[nodiscard]] std::vector<double> run_weights(const Likelihood& likelihood, const Robot& robot,
                                              const EstimableSpace& space);

/// By how much the scores of clusters (runs, or blocks of few runs) scatter more than their noise says.
struct Dispersion {
  double factor = 1.0;  ///< of the covariance; at least 1
  int degrees_of_freedom = 0;
  std::vector<RunEvidence> runs;
};
[[nodiscard]] Dispersion dispersion_of(const Likelihood& likelihood, const Robot& robot,
                                       const EstimableSpace& space);

}  // namespace trundle::calibration
