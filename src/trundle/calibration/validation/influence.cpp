#include "trundle/calibration/validation/influence.hpp"

#include "trundle/calibration/validation/run_steps.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

/// eq. 14: B (A + I)⁻¹ Bᵀ.
Eigen::MatrixXd covariance_by(const RunSteps& steps, const Information& of_some) {
  return steps.basis() * divide_ldlt(steps.basis(), RunSteps::precision(of_some)).transpose();
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
    influence.sigma_after.push_back(covariance_by(steps, all).diagonal().cwiseMax(0.0).cwiseSqrt());
  }
  for (const RunEvidence& run : estimate.runs) {
    Information rest = all;
    rest.add(steps.of(run), -1.0);
    influence.without.push_back(values_by(steps, rest));
    influence.covariance_without.push_back(covariance_by(steps, rest));
  }
  return influence;
}

std::vector<Eigen::VectorXd> without_holding(std::size_t parameter, double value,
                                             const Influence& influence) {
  const auto j = static_cast<Eigen::Index>(parameter);
  std::vector<Eigen::VectorXd> values = influence.without;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Eigen::MatrixXd& covariance = influence.covariance_without[i];
    if (covariance(j, j) > 0.0)  // else it is held already
      values[i] += covariance.col(j) * ((value - values[i][j]) / covariance(j, j));
  }
  return values;
}

}  // namespace trundle::calibration
