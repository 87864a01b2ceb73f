#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/solve/estimator.hpp"

namespace trundle::calibration {

/// What an estimate would be with other runs than all of them, by one Gauss–Newton step from it
/// (docs/theory/calibration-uncertainty.md, eq. 13 and 14). In the parameters' own units; one entry for each
/// run, in order.
struct Influence {
  std::vector<Eigen::VectorXd> without;  ///< all runs but this one
  std::vector<Eigen::MatrixXd> covariance_without;
  std::vector<Eigen::VectorXd> after;        ///< this one and those before it
  std::vector<Eigen::VectorXd> sigma_after;  ///< 1σ of `after`; what no run has told yet: its prior's
};

/// All of them without a run, where one parameter is held at a value and the others go along.
[[nodiscard]] std::vector<Eigen::VectorXd> without_holding(std::size_t parameter, double value,
                                                           const Influence& influence);

/// What is not determined by the runs that are left stays at its nominal value, known to its prior sigma.
Influence influence_of(const Estimate& estimate, const Robot& nominal, std::span<const Parameter> parameters);

}  // namespace trundle::calibration
