#pragma once

#include <span>

#include <Eigen/Core>

#include "trundle/calibration/solve/estimator.hpp"

namespace trundle::calibration {

/// Gauss–Newton steps from an estimate to what other runs than all of them say, in the coordinates of the
/// estimable space, in which the prior is the unit matrix. docs/theory/calibration-uncertainty.md, eq.
/// 13, 14.
class RunSteps {
 public:
  RunSteps(const Estimate& estimate, const Robot& nominal, std::span<const Parameter> parameters);

  /// What a run says.
  [[nodiscard]] Information of(const RunEvidence& run) const;
  [[nodiscard]] Information of_all(std::span<const RunEvidence> runs) const;
  /// A + I.
  [[nodiscard]] static Eigen::MatrixXd precision(const Information& of_some);
  /// eq. 13: u = (A + I)⁻¹ (b − û).
  [[nodiscard]] Eigen::VectorXd step(const Information& of_some) const;

  /// The columns: the parameters, in their own units, by u.
  [[nodiscard]] const Eigen::MatrixXd& basis() const { return basis_; }
  [[nodiscard]] const Eigen::VectorXd& estimate() const { return estimate_; }

 private:
  Eigen::VectorXd estimate_;  ///< of the parameters
  Eigen::MatrixXd basis_;
  Eigen::VectorXd moved_;  ///< û: the estimate from nominal
  double dispersion_;
};

}  // namespace trundle::calibration
