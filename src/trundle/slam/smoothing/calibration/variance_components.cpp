#include "trundle/slam/smoothing/calibration/variance_components.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Residuals e of weight W, their derivative J by some of the unknowns, and the covariance of J times those.
struct ResidualBlock {
  VectorXd error;
  MatrixXd weight;
  MatrixXd by_unknowns;
  std::vector<Index> unknowns;
  MatrixXd known_by_others;  ///< J C Jᵀ
};

ResidualBlock block_of(const SightingLink& link, const SmoothingProblem& problem, const SmoothingState& state,
                       const Minimiser& linearised) {
  const SightingResidual r = sighting_residual(problem, link, state);
  const Eigen::Matrix2Xd by_parameters = through_errors_of(link.sensor, problem, r.by_sensor);
  const Index parameters = by_parameters.cols();
  ResidualBlock block;
  block.error = r.error;
  block.weight = robust_weight(r.error.squaredNorm(), problem.gate) * Matrix2::Identity();
  block.by_unknowns.resize(2, 5 + parameters);
  block.by_unknowns << r.by_pose, r.by_landmark, by_parameters;
  const Index pose = linearised.row_of_pose(link.pose);
  const Index landmark = linearised.row_of_landmark(link.landmark);
  block.unknowns = {pose, pose + 1, pose + 2, landmark, landmark + 1};
  for (Index i = 0; i < parameters; ++i) block.unknowns.push_back(linearised.row_of_parameters() + i);
  MatrixXd C(5 + parameters, 5 + parameters);
  C.topLeftCorner<3, 3>() = linearised.pose_covariance(link.pose);
  C.block<3, 2>(0, 3) = linearised.pose_landmark_covariance(link.pose, link.landmark);
  C.block<2, 2>(3, 3) = linearised.landmark_covariance(link.landmark);
  if (parameters > 0) {
    C.block(0, 5, 3, parameters) = linearised.pose_parameter_covariance(link.pose);
    C.block(3, 5, 2, parameters) = linearised.landmark_parameter_covariance(link.landmark);
    C.bottomRightCorner(parameters, parameters) = linearised.parameter_covariance();
  }
  C.triangularView<Eigen::StrictlyLower>() = C.transpose();
  block.known_by_others = block.by_unknowns * C * block.by_unknowns.transpose();
  return block;
}

ResidualBlock block_of(const MotionLink& link, const SmoothingState& state, const Minimiser& linearised) {
  const MotionResidual r = motion_residual(link, state);
  const bool known = link.from == MotionLink::kKnown;
  const Index before = known ? 0 : 3;
  const Index parameters = state.parameters.size();
  const Index n = before + 3 + parameters;
  ResidualBlock block;
  block.error = r.error.head<3>();
  block.weight = link.information.topLeftCorner<3, 3>();
  block.by_unknowns.resize(3, n);
  if (!known) block.by_unknowns.leftCols<3>() = r.by_from.topLeftCorner<3, 3>();
  block.by_unknowns.middleCols<3>(before) = r.by_to.topLeftCorner<3, 3>();
  block.by_unknowns.rightCols(parameters) = -link.by_parameters;
  MatrixXd C(n, n);
  const auto add_pose = [&](int pose, Index at) {
    for (Index i = 0; i < 3; ++i) block.unknowns.push_back(linearised.row_of_pose(pose) + i);
    C.block<3, 3>(at, at) = linearised.pose_covariance(pose);
    if (parameters == 0) return;
    C.block(at, n - parameters, 3, parameters) = linearised.pose_parameter_covariance(pose);
    C.block(n - parameters, at, parameters, 3) = C.block(at, n - parameters, 3, parameters).transpose();
  };
  if (!known) add_pose(link.from, 0);
  add_pose(link.to, before);
  if (!known) {
    C.block<3, 3>(0, 3) = linearised.pose_covariance(link.from, link.to);
    C.block<3, 3>(3, 0) = C.block<3, 3>(0, 3).transpose();
  }
  if (parameters > 0) C.bottomRightCorner(parameters, parameters) = linearised.parameter_covariance();
  for (Index i = 0; i < parameters; ++i) block.unknowns.push_back(linearised.row_of_parameters() + i);
  block.known_by_others = block.by_unknowns * C * block.by_unknowns.transpose();
  return block;
}

/// Sums over residual blocks, for each noise.
class ComponentSums {
 public:
  ComponentSums(Index noises, Index unknowns)
      : evidence_{VectorXd::Zero(noises), MatrixXd::Zero(noises, noises), VectorXd::Zero(noises)},
        by_unknowns_(MatrixXd::Zero(unknowns, noises)) {}

  /// `derivative`: D of each noise for this block; empty matrix: none. With w = D W e, eq. 18 and 19.
  void add(const ResidualBlock& block, std::span<const MatrixXd> derivative) {
    const VectorXd We = block.weight * block.error;
    const auto noises = static_cast<Index>(derivative.size());
    MatrixXd w = MatrixXd::Zero(block.error.size(), noises);
    for (Index c = 0; c < noises; ++c) {
      const MatrixXd& D = derivative[static_cast<std::size_t>(c)];
      if (D.size() == 0) continue;
      w.col(c) = D * We;
      const double redundancy =
          (block.weight * D).trace() - (block.weight * D * block.weight * block.known_by_others).trace();
      evidence_.redundancy[c] += redundancy;
      evidence_.score[c] += 0.5 * (We.dot(w.col(c)) - redundancy);
    }
    const MatrixXd Ww = block.weight * w;
    evidence_.information += 0.5 * w.transpose() * Ww;
    const MatrixXd JWw = block.by_unknowns.transpose() * Ww;
    for (std::size_t i = 0; i < block.unknowns.size(); ++i)
      by_unknowns_.row(block.unknowns[i]) += JWw.row(static_cast<Index>(i));
  }

  ComponentEvidence evidence(const Minimiser& linearised) {
    for (Index c = 0; c < by_unknowns_.cols(); ++c)
      evidence_.information.col(c) -= 0.5 * by_unknowns_.transpose() * linearised.solve(by_unknowns_.col(c));
    evidence_.information = (0.5 * (evidence_.information + evidence_.information.transpose())).eval();
    return std::move(evidence_);
  }

 private:
  ComponentEvidence evidence_;
  MatrixXd by_unknowns_;  ///< Jᵀ W w, a column for each noise
};

}  // namespace

ComponentEvidence component_evidence(const SmoothingProblem& problem, const SmoothingState& state,
                                     const Minimiser& linearised, std::span<const NoiseDerivative> noises) {
  ComponentSums sums(static_cast<Index>(noises.size()), linearised.unknowns());
  std::vector<MatrixXd> derivative(noises.size());
  for (std::size_t k = 0; k < problem.motions.size(); ++k) {
    for (std::size_t c = 0; c < noises.size(); ++c)
      derivative[c] = noises[c].of_motions.empty() ? MatrixXd() : MatrixXd(noises[c].of_motions[k]);
    sums.add(block_of(problem.motions[k], state, linearised), derivative);
  }
  for (const SightingLink& link : problem.sightings) {
    const ResidualBlock block = block_of(link, problem, state, linearised);
    for (std::size_t c = 0; c < noises.size(); ++c)
      derivative[c] = noises[c].of_reading.isZero()
                          ? MatrixXd()
                          : MatrixXd(noises[c].of_reading.asDiagonal()) / block.weight(0, 0);
    sums.add(block, derivative);
  }
  return sums.evidence(linearised);
}

}  // namespace trundle::slam
