#pragma once

#include <span>
#include <vector>

#include "trundle/calibration/information.hpp"
#include "trundle/calibration/noise.hpp"
#include "trundle/calibration/subspace.hpp"

namespace trundle {

/// What one run contributed to an estimate.
struct RunEvidence {
  double weight = 1.0;        ///< below 1: down-weighted, it pulls the parameters away from all others
  double chi2_per_dof = 0.0;  ///< of its pull on the parameters; 1 is expected
  std::vector<OutlyingKnot> outliers;
  Information information;  ///< about the parameters, at the estimate; times the weight
};

/// How a search for parameters ended.
struct Descent {
  bool converged = false;
  int iterations = 0;
  double last_step = 0.0;  ///< in sigmas of the estimate
  int parameter = -1;      ///< that moved farthest in it; none: −1
};

/// Maximum-likelihood parameters of a robot from runs, with the evidence.
struct Estimate {
  Robot robot;  ///< with the parameters found
  NoiseEstimate noise;
  EstimableSpace space;
  Eigen::MatrixXd covariance;  ///< of all parameters in their own units; zero rows where held
  double dispersion = 1.0;     ///< by which the runs scatter more than their noise: part of the covariance
  int degrees_of_freedom = 0;  ///< behind the dispersion
  std::vector<RunEvidence> runs;
  Descent descent;
};

/// Gauss–Newton on the information of all runs, in the space that they can tell; noise levels and weights of
/// outlying runs are found in between. docs/theory/calibration.md.
Estimate estimate_parameters(std::span<const Run> runs, const Robot& nominal,
                             std::span<const Parameter> parameters);

}  // namespace trundle
