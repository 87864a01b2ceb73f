#include "trundle/calibration/validation/influence.hpp"

#include "trundle/calibration/validation/run_steps.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

/// eq. 14: the square roots of the diagonal of B (A + I)⁻¹ Bᵀ.
Eigen::VectorXd sigma_of(const RunSteps& steps, const Information& of_some) {
  const Eigen::MatrixXd covariance =
      steps.basis() * divide_ldlt(steps.basis(), RunSteps::precision(of_some)).transpose();
  return covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

Eigen::VectorXd values_by(const RunSteps& steps, const Information& of_some) {
  return steps.estimate() + steps.basis() * steps.step(of_some);
}

}  // namespace

Influence influence_of(const Estimate& estimate, const Robot& nominal,
                       std::span<const Parameter> parameters) {
  Influence influence;
  const RunSteps steps(estimate, nominal, parameters);
  Information all = Information::zero(estimate.space.basis.cols());
  for (const RunEvidence& run : estimate.runs) {
    all.add(steps.of(run));
    influence.after.push_back(values_by(steps, all));
    influence.sigma_after.push_back(sigma_of(steps, all));
  }
  for (const RunEvidence& run : estimate.runs) {
    Information rest = all;
    rest.add(steps.of(run), -1.0);
    influence.without.push_back(values_by(steps, rest));
  }
  return influence;
}

}  // namespace trundle::calibration
