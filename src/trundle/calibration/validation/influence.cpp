#include "trundle/calibration/validation/influence.hpp"

#include <cmath>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

Eigen::VectorXd values_of(const Robot& robot, std::span<const Parameter> parameters) {
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t j = 0; j < parameters.size(); ++j)
    values[static_cast<Eigen::Index>(j)] = value_of(parameters[j], robot);
  return values;
}

/// The problem in the coordinates of the estimable space, in which the prior is the unit matrix.
class Steps {
 public:
  Steps(const Estimate& estimate, const Robot& nominal, std::span<const Parameter> parameters)
      : estimate_(values_of(estimate.robot, parameters)),
        basis_(estimate.space.scale.asDiagonal() * estimate.space.basis),
        moved_(
            estimate.space.basis.transpose() *
            ((estimate_ - values_of(nominal, parameters)).array() / estimate.space.scale.array()).matrix()),
        dispersion_(estimate.dispersion) {}

  Information of_run(const RunEvidence& run) const {
    Information information = Information::zero(basis_.cols());
    information.matrix = congruent(run.information.matrix, basis_) / dispersion_;
    information.gradient = basis_.transpose() * run.information.gradient / dispersion_;
    return information;
  }

  /// eq. 13: u = (A + I)⁻¹ (b − û).
  Eigen::VectorXd step(const Information& of_some) const {
    return estimate_ + basis_ * solve_ldlt(precision(of_some), of_some.gradient - moved_);
  }

  /// eq. 14: the square roots of the diagonal of B (A + I)⁻¹ Bᵀ.
  Eigen::VectorXd sigma(const Information& of_some) const {
    const Eigen::MatrixXd covariance = basis_ * divide_ldlt(basis_, precision(of_some)).transpose();
    return covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  }

 private:
  static Eigen::MatrixXd precision(const Information& of_some) {
    return of_some.matrix + Eigen::MatrixXd::Identity(of_some.matrix.rows(), of_some.matrix.cols());
  }

  Eigen::VectorXd estimate_;
  Eigen::MatrixXd basis_;  ///< of the parameters in their own units
  Eigen::VectorXd moved_;  ///< û: from nominal, in prior sigmas
  double dispersion_;
};

}  // namespace

Influence influence_of(const Estimate& estimate, const Robot& nominal,
                       std::span<const Parameter> parameters) {
  Influence influence;
  const Steps steps(estimate, nominal, parameters);
  Information all = Information::zero(estimate.space.basis.cols());
  for (const RunEvidence& run : estimate.runs) {
    all.add(steps.of_run(run));
    influence.after.push_back(steps.step(all));
    influence.sigma_after.push_back(steps.sigma(all));
  }
  for (const RunEvidence& run : estimate.runs) {
    Information rest = all;
    rest.add(steps.of_run(run), -1.0);
    influence.without.push_back(steps.step(rest));
  }
  return influence;
}

}  // namespace trundle::calibration
