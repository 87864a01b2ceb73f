#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// A parameter of one run alone, as the clock of its reference: no other run knows of it, and nobody asks for
/// it. It is eliminated from what the run says of the parameters that all runs share.
struct OwnParameter {
  std::optional<Parameter> parameter;  ///< none: of no robot, as the heading at the start
  double prior_sigma = 0.0;
  double moved = 0.0;  ///< from the mean of its prior to where the run has it now
};

/// The parameters, and those of a run behind them that are parameters of a robot.
[[nodiscard]] std::vector<Parameter> with_own(std::span<const Parameter> parameters,
                                              std::span<const OwnParameter> own);

/// Where a run's own parameters fit best with the others as they are, from where they are.
struct OwnStep {
  Eigen::VectorXd step;
  Eigen::MatrixXd covariance;  ///< were the others known
  Eigen::MatrixXd follows;     ///< ∂(own)/∂(others): to where they fit best
};
/// Of what a run says, the last of whose parameters are its own.
[[nodiscard]] OwnStep own_step(const Information& with_own, std::span<const OwnParameter> own);

/// What a run says, the last of whose parameters are its own, with these eliminated: they follow the others
/// to where they fit best. The sum is the Schur complement of the sum. docs/theory/calibration-runs.md, eq.
/// 6b.
[[nodiscard]] std::vector<Information> without_own(const std::vector<Information>& blocks,
                                                   std::span<const OwnParameter> own);

/// log |A_oo + Λ| − log |Λ|, A_oo the information of the own parameters and Λ that of their priors: −2 log of
/// what integrating over them takes from the likelihood. docs/theory/calibration-runs.md, eq. 6c.
[[nodiscard]] double log_determinant_of_own(const Information& with_own, std::span<const OwnParameter> own);

}  // namespace trundle::calibration
