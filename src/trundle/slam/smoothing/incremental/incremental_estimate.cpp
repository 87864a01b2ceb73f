// IncrementalSmoother: what is known now.
#include "trundle/slam/smoothing/incremental/incremental_belief.hpp"
#include "trundle/slam/smoothing/solver/normal_equations.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Of (e, s): what of it is of the motion since the keyframe, and what is of the keyframe, or of the prior
/// where there is none yet, and of the systematic errors.
MatrixXd covariance_with_systematic(const IncrementalBelief& belief, const FreeMotion& motion) {
  const FactorGraph& graph = belief.graph;
  const Systematic& sigma = belief.options.prior.systematic_sigma;
  const Index numbers = 3 + sigma.size();
  MatrixXd P = MatrixXd::Zero(numbers, numbers);
  P.topLeftCorner<3, 3>() = motion.covariance;
  MatrixXd by_pose = MatrixXd::Zero(numbers, pose_size(graph.problem()));
  by_pose.topLeftCorner<3, 3>() = adjoint(motion.mean.inverse());
  if (belief.options.has_bias) {
    P.block<3, 1>(0, 3) = motion.with_walk;
    P.block<1, 3>(3, 0) = motion.with_walk.transpose();
    P(3, 3) = motion.walk;
    by_pose.block<3, 1>(0, 3) = motion.by_bias;
    by_pose(3, 3) = 1.0;
  }
  MatrixXd by_parameters = MatrixXd::Zero(numbers, static_cast<Index>(belief.free.size()));
  by_parameters.topRows<3>() = motion.by_parameters;
  for (std::size_t i = 0; i < belief.free.size(); ++i)
    by_parameters(3 + belief.free[i], static_cast<Index>(i)) = 1.0;
  if (graph.poses() == 0) {
    const MatrixXd of_parameters = by_parameters * sigma(belief.free).asDiagonal();
    P += of_parameters * of_parameters.transpose();
    if (belief.options.has_bias) P += sigma[0] * sigma[0] * by_pose.col(3) * by_pose.col(3).transpose();
    return P;
  }
  std::vector<EliminationTree::Derivative> derivatives{{graph.last_pose_variable(), 0, by_pose.transpose()}};
  if (graph.parameter_variable() >= 0)
    derivatives.push_back({graph.parameter_variable(), 0, by_parameters.transpose()});
  return P + graph.covariance(derivatives, numbers);
}

Pose2 pose_after(const IncrementalBelief& belief, const SinceKeyframe& since) {
  const FactorGraph& graph = belief.graph;
  if (graph.poses() == 0) return belief.options.prior.start * since.motion.mean;
  const Vector3 effect = since.motion.by_parameters * (graph.parameters() - since.parameters) +
                         since.motion.by_bias * (graph.last_bias() - since.bias);
  return graph.last_pose() * since.motion.mean * exp(Twist2::from(effect));
}

}  // namespace

/// The mean is that of what is known of the systematic errors at the keyframe.
SinceKeyframe moved_on(const Motion& motion, const IncrementalBelief& belief) {
  const SinceKeyframe& since = belief.since;
  const BySystematic by_all = motion.by_first(belief.options.prior.systematic_sigma.size());
  FreeMotion step{motion.mean, motion.covariance, by_all(Eigen::all, belief.free)};
  if (belief.options.has_bias) {
    step.by_bias = by_all.col(0);
    step.walk = motion.walk;
    step.with_walk = motion.with_walk;
  }
  const Vector3 effect = step.by_parameters * since.parameters + step.by_bias * since.bias;
  step.mean = step.mean * exp(Twist2::from(effect));
  return {since.motion * step, since.bias, since.parameters, true};
}

Pose2 pose_now(const IncrementalBelief& belief) {
  return pose_after(belief, belief.since);
}

void append_by_body(const IncrementalBelief& belief, const MatrixXd& by_body, Index column,
                    std::vector<EliminationTree::Derivative>& derivatives) {
  const FactorGraph& graph = belief.graph;
  const SinceKeyframe& since = belief.since;
  Eigen::Matrix<double, 3, Eigen::Dynamic> by_pose(3, pose_size(graph.problem()));
  by_pose.leftCols<3>() = adjoint(since.motion.mean.inverse());
  if (belief.options.has_bias) by_pose.col(3) = since.motion.by_bias;
  derivatives.push_back({graph.last_pose_variable(), column, (by_body * by_pose).transpose()});
  if (graph.parameter_variable() >= 0)
    derivatives.push_back(
        {graph.parameter_variable(), column, (by_body * since.motion.by_parameters).transpose()});
}

PoseEstimate estimate_of(const IncrementalBelief& belief) {
  return estimate_of(belief, belief.since);
}

PoseEstimate estimate_of(const IncrementalBelief& belief, const SinceKeyframe& since) {
  const Index systematic = belief.options.prior.systematic_sigma.size();
  PoseEstimate estimate{.pose = pose_after(belief, since)};
  estimate.systematic = Systematic::Zero(systematic);
  if (belief.options.has_bias) estimate.systematic[0] = belief.graph.last_bias();
  const VectorXd p = belief.graph.parameters();
  for (std::size_t i = 0; i < belief.free.size(); ++i)
    estimate.systematic[belief.free[i]] = p[static_cast<Index>(i)];

  const MatrixXd P = covariance_with_systematic(belief, since.motion);
  const Matrix3 axes = world_from_body_axes(estimate.pose);
  estimate.covariance = axes * P.topLeftCorner<3, 3>() * axes.transpose();
  estimate.with_systematic = axes * P.topRightCorner(3, systematic);
  estimate.systematic_covariance = P.bottomRightCorner(systematic, systematic);
  return estimate;
}

}  // namespace trundle::slam
