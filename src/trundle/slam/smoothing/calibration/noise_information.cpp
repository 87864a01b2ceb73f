#include "trundle/slam/smoothing/calibration/noise_information.hpp"

#include "trundle/calibration/likelihood/information.hpp"

namespace trundle::slam {
namespace {

/// Covariance of the motion's error, given all that was seen.
Matrix3 covariance_of(const MotionLink& link, const SmoothingState& state, const Minimiser& linearised) {
  const Eigen::Index n = state.parameters.size();
  const MotionResidual r = motion_residual(link, state);
  Eigen::Matrix3Xd by = Eigen::Matrix3Xd::Zero(3, 6 + n);  // moves of both poses, and parameters
  by.middleCols<3>(3) = r.by_to.topLeftCorner<3, 3>();
  by.rightCols(n) = -link.by_parameters;
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(6 + n, 6 + n);
  joint.block<3, 3>(3, 3) = linearised.pose_covariance(link.to).topLeftCorner<3, 3>();
  joint.block(3, 6, 3, n) = linearised.pose_parameter_covariance(link.to).topRows<3>();
  joint.bottomRightCorner(n, n) = linearised.parameter_covariance();
  if (link.from != MotionLink::kKnown) {
    by.leftCols<3>() = r.by_from.topLeftCorner<3, 3>();
    joint.topLeftCorner<3, 3>() = linearised.pose_covariance(link.from).topLeftCorner<3, 3>();
    joint.block<3, 3>(0, 3) = linearised.pose_covariance(link.from, link.to).topLeftCorner<3, 3>();
    joint.block(0, 6, 3, n) = linearised.pose_parameter_covariance(link.from).topRows<3>();
  }
  return by * joint.selfadjointView<Eigen::Upper>() * by.transpose();
}

}  // namespace

Eigen::MatrixXd noise_information(const SmoothingProblem& problem, const SmoothingState& state,
                                  const Minimiser& linearised, Eigen::Index n) {
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(n, n);
  for (const MotionLink& link : problem.motions) {
    const calibration::ReadingErrors& errors = link.reading_errors;
    if (errors.scatter.size() == 0) continue;
    const Matrix3 W = link.information.topLeftCorner<3, 3>();
    const Matrix3 M = W - W * covariance_of(link, state, linearised) * W;
    Eigen::MatrixX3d revealed(3 * n, 3);  // by W e, of each sensitivity
    for (Eigen::Index j = 0; j < n; ++j)
      revealed.middleRows<3>(3 * j) = errors.sensitivity.middleCols<3>(3 * j);
    sum += calibration::information_of_noise(
        M, errors.scatter.topLeftCorner(3 * n, 3 * n) - revealed * M * revealed.transpose());
  }
  return sum;
}

}  // namespace trundle::slam
