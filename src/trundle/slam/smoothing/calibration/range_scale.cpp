#include "trundle/slam/smoothing/calibration/range_scale.hpp"

#include "trundle/io/error.hpp"

namespace trundle::slam {
namespace {

/// With the scale, in this unit, as one more that is sought behind the robot's parameters.
FreeColumns with_range_scale(const FreeColumns& free, const Robot& robot) {
  const Eigen::Index rows = free.columns.rows(), sought = free.columns.cols();
  FreeColumns wider = free;
  wider.parameters.push_back(kRangeScale);
  wider.columns.setZero(rows + 1, sought + 1);
  wider.columns.topLeftCorner(rows, sought) = free.columns;
  wider.columns(rows, sought) = prior_sigma(kRangeScale, robot);
  wider.information.conservativeResize(sought + 1);
  wider.information[sought] = 1.0;
  return wider;
}

}  // namespace

Eigen::VectorXd taken_along_by_range_scale(std::span<const AssociatedRecording> all, const LandmarkFit& fit) {
  const FreeColumns free = with_range_scale(fit.free, fit.estimate.robot);
  JointProblem joint = joint_problem(all, fit.estimate.robot, free);
  SmoothingState state = fit.state;
  state.parameters = free.parameters_from_here(fit.state.parameters);
  correct_readings(state, joint.problem);
  Minimiser minimiser(joint.problem);
  if (!minimiser.linearise(joint.problem, state))
    throw CannotAnswer("the sightings leave poses or landmarks undetermined");
  const Eigen::Index sought = free.columns.cols();
  const Eigen::VectorXd with_scale = minimiser.parameter_covariance().col(sought - 1).head(sought);
  const Eigen::VectorXd moved =
      free.columns * with_scale;  // cov(p, scale) in that unit, the scale itself last
  const Eigen::Index n = moved.size() - 1;
  return moved.head(n) / moved[n];
}

}  // namespace trundle::slam
