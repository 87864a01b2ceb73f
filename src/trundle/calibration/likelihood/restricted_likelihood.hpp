#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/likelihood/likelihood.hpp"

namespace trundle::calibration {

/// What each run says, near a robot, of the parameters that all share and of its own.
struct RunsInformation {
  std::vector<Information> information;
  std::vector<std::vector<OwnParameter>> own;
  Eigen::VectorXd prior_sigma;  ///< of the shared ones
};

[[nodiscard]] RunsInformation information_of_runs(const Likelihood& likelihood, const Robot& robot);

/// What −2 log of the likelihood grows by when all parameters are integrated over: of levels of noise, and of
/// other variances. docs/theory/calibration-noise.md, eq. 8d.
struct Restriction {
  /// log |Λ⁻¹ A + 1|, Λ of the priors: what residuals lack for having been fitted by as many parameters.
  double log_determinant = 0.0;
  double chi2 = 0.0;  ///< of the best fit, less that of the robot
};
/// Infinite where what the runs say contradicts itself.
[[nodiscard]] Restriction restriction(const RunsInformation& runs);

}  // namespace trundle::calibration
