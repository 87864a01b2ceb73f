#include "trundle/calibration/validation/run_steps.hpp"

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {

RunSteps::RunSteps(const Estimate& estimate, const Robot& nominal, std::span<const Parameter> parameters)
    : estimate_(values_of(estimate.robot, parameters)),
      basis_(estimate.space.scale.asDiagonal() * estimate.space.basis),
      moved_(estimate.space.basis.transpose() *
             ((estimate_ - values_of(nominal, parameters)).array() / estimate.space.scale.array()).matrix()),
      dispersion_(estimate.dispersion) {}

Information RunSteps::of(const RunEvidence& run) const {
  Information information = Information::zero(basis_.cols());
  information.matrix = congruent(run.information.matrix, basis_) / dispersion_;
  information.gradient = basis_.transpose() * run.information.gradient / dispersion_;
  return information;
}

Information RunSteps::of_all(std::span<const RunEvidence> runs) const {
  Information all = Information::zero(basis_.cols());
  for (const RunEvidence& run : runs) all.add(of(run));
  return all;
}

Eigen::MatrixXd RunSteps::precision(const Information& of_some) {
  return of_some.matrix + Eigen::MatrixXd::Identity(of_some.matrix.rows(), of_some.matrix.cols());
}

Eigen::VectorXd RunSteps::step(const Information& of_some) const {
  return solve_ldlt(precision(of_some), of_some.gradient - moved_);
}

}  // namespace trundle::calibration
