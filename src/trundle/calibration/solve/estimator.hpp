#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/calibration/likelihood/gyro_bias_spread.hpp"
#include "trundle/calibration/problem/problem.hpp"
#include "trundle/calibration/solve/observability.hpp"
#include "trundle/calibration/solve/scores.hpp"
#include "trundle/statistics/descent.hpp"

namespace trundle::calibration {

/// Maximum-likelihood parameters of a robot from runs, with the evidence.
struct Estimate {
  Robot robot;  ///< with the parameters found
  NoiseEstimate noise;
  GyroBiasSpread gyro_bias_spread = {};
  EstimableSpace space;
  Eigen::MatrixXd covariance;       ///< of all parameters in their own units; zero rows where held
  Eigen::MatrixXd held_covariance;  ///< of what is held, in the same units; to be added
  double dispersion = 1.0;     ///< by which the runs scatter more than their noise: part of the covariance
  int degrees_of_freedom = 0;  ///< behind the dispersion
  std::vector<RunEvidence> runs;
  /// Of the gyro in each run, where runs have biases of their own; nothing: the run does not show it.
  std::vector<std::optional<GyroBias>> gyro_biases = {};
  Descent descent;
  bool measures_length = false;  ///< the runs were measured in metres, from outside
};

/// Gauss–Newton on the information of all runs, in the space that they can determine; noise levels and
/// weights of outlying runs are found in between. docs/theory/calibration.md.
[[nodiscard]] Estimate estimate_parameters(const CalibrationProblem& problem);

/// How wrong the robot as given is by what was estimated of it: E[(p − given)(p − given)ᵀ], each parameter at
/// most as wrong as given may be (prior_covariance()). In the parameters' own units.
[[nodiscard]] Eigen::MatrixXd error_as_given(const CalibrationProblem& problem, const Estimate& estimate);

/// D: by how much what was estimated is off for each unit that `given` parameters, which stay as they are,
/// are off. Rows: the problem's parameters; columns: given; in their own units.
[[nodiscard]] Eigen::MatrixXd taken_along(std::span<const Parameter> given, const CalibrationProblem& problem,
                                          const Estimate& estimate);

/// Parameters that stay as given and may be wrong, and have taken along what was estimated beside them, in
/// their own units. docs/theory/calibration-uncertainty.md, eq. 16.
struct GivenParameters {
  std::vector<Parameter> parameters = {};
  Eigen::MatrixXd covariance = {};        ///< of their errors
  Eigen::MatrixXd cross_covariance = {};  ///< with what was estimated: its rows, their columns
};

/// Those whose errors have this covariance; what D (taken_along()) makes of them goes into the estimate's
/// held_covariance.
[[nodiscard]] GivenParameters given_beside(std::span<const Parameter> given,
                                           const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& D,
                                           Estimate& estimate);

}  // namespace trundle::calibration
