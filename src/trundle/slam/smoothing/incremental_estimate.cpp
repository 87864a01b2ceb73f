// IncrementalSmoother: what is known, and what readings are judged by.
#include <array>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/slam/smoothing/minimise.hpp"
#include "trundle/slam/smoothing/normal_equations.hpp"
#include "trundle/slam/smoothing/nth.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace

/// Of what shows, or may show, landmarks of the map, by what is known before it counts:
/// docs/theory/online-smoother.md, eq. 24.
IncrementalSmoother::Innovations IncrementalSmoother::innovations(
    std::span<const Match> matches, std::span<const Observation> observations) const {
  const Index numbers = 2 * static_cast<Index>(matches.size());
  Innovations result{VectorXd(numbers), {}};
  if (matches.empty()) return result;
  const Pose2 pose = pose_now();
  const Matrix3 axes = world_from_body_axes(pose);
  std::vector<EliminationTree::Derivative> derivatives;
  MatrixXd by_body(numbers, 3);
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const auto [observation, landmark] = matches[k];
    const auto row = 2 * static_cast<Index>(k);
    const ExpectedReading expected =
        expected_reading(pose, problem_.sensors.front().body_from_sensor, landmark_at(landmark));
    result.innovation.segment<2>(row) = innovation_of(observations[observation], expected);
    derivatives.push_back({map_.landmarks[nth(landmark)].variable, row, expected.by_landmark.transpose()});
    by_body.middleRows<2>(row) = expected.by_pose * axes;
  }
  append_by_body(by_body, 0, derivatives);
  result.S = tree_.projected_covariance(derivatives, numbers);
  result.S += by_body * since_.motion.covariance * by_body.transpose();
  const Matrix2 R = reading_covariance(problem_.sensors.front());
  for (Index row = 0; row < numbers; row += 2) result.S.block<2, 2>(row, row) += R;
  return result;
}

/// NIS of what shows landmarks of the map.
void IncrementalSmoother::judge(std::span<const std::size_t> shown,
                                std::span<const Observation> observations) {
  std::vector<Match> known;
  for (const std::size_t i : shown) {
    report_.observations[i].decision = Decision::created;
    const int landmark = landmark_of(i, observations[i]);
    if (landmark >= 0) known.push_back({i, landmark});
  }
  const Innovations all = innovations(known, observations);
  for (std::size_t k = 0; k < known.size(); ++k) {
    ObservationReport& report = report_.observations[known[k].observation];
    const auto row = 2 * static_cast<Index>(k);
    const Matrix2 S = all.S.block<2, 2>(row, row);
    report.innovation = all.innovation.segment<2>(row);
    report.nis = report.innovation.dot(S.llt().solve(report.innovation));
    report.decision = report.nis <= options_.gate ? Decision::matched : Decision::rejected;
  }
}

/// How numbers that depend on a move of the body now depend on the last keyframe and the systematic errors.
void IncrementalSmoother::append_by_body(const MatrixXd& by_body, Index column,
                                         std::vector<EliminationTree::Derivative>& derivatives) const {
  Eigen::Matrix<double, 3, Eigen::Dynamic> by_pose(3, pose_size(problem_));
  by_pose.leftCols<3>() = adjoint(since_.motion.mean.inverse());
  if (problem_.has_bias) by_pose.col(3) = since_.motion.by_bias;
  derivatives.push_back({pose_variables_.back(), column, (by_body * by_pose).transpose()});
  if (parameter_variable_ >= 0)
    derivatives.push_back({parameter_variable_, column, (by_body * since_.motion.by_parameters).transpose()});
}

SmoothingState IncrementalSmoother::state() const {
  SmoothingState state = at_;
  for (int i = 0; i < problem_.poses; ++i) {
    state.poses[nth(i)] = pose_at(i);
    if (problem_.has_bias) state.biases[nth(i)] = bias_at(i);
  }
  for (int i = 0; i < problem_.landmarks; ++i) state.landmarks[nth(i)] = landmark_at(i);
  state.parameters = parameters();
  return state;
}

std::vector<StampedPose> IncrementalSmoother::path() const {
  std::vector<StampedPose> path;
  for (int i = 0; i < problem_.poses; ++i) path.push_back({stamps_[nth(i)], pose_at(i)});
  return path;
}

Pose2 IncrementalSmoother::pose_at(int keyframe) const {
  return moved_by(tree_.solution(pose_variables_[nth(keyframe)]).head<3>(), at_.poses[nth(keyframe)]);
}

double IncrementalSmoother::bias_at(int keyframe) const {
  return at_.bias_at(keyframe) + tree_.solution(pose_variables_[nth(keyframe)])[3];
}

double IncrementalSmoother::keyframe_bias() const {
  return !problem_.has_bias || pose_variables_.empty()
             ? 0.0
             : bias_at(static_cast<int>(pose_variables_.size()) - 1);
}

VectorXd IncrementalSmoother::parameters() const {
  if (parameter_variable_ < 0) return at_.parameters;
  return at_.parameters + tree_.solution(parameter_variable_);
}

Vector2 IncrementalSmoother::landmark_at(int landmark) const {
  return at_.landmarks[nth(landmark)] + tree_.solution(map_.landmarks[nth(landmark)].variable);
}

/// What is known of the systematic errors may have changed since the keyframe.
Pose2 IncrementalSmoother::pose_after(const SinceKeyframe& since) const {
  if (pose_variables_.empty()) return options_.prior.start * since.motion.mean;
  const Vector3 effect = since.motion.by_parameters * (parameters() - since.parameters) +
                         since.motion.by_bias * (keyframe_bias() - since.bias);
  return pose_at(static_cast<int>(pose_variables_.size()) - 1) * since.motion.mean *
         exp(Twist2::from(effect));
}

MappedLandmark IncrementalSmoother::landmark(std::size_t index) const {
  const Landmark& landmark = map_.landmarks[index];
  const std::array<EliminationTree::Derivative, 1> itself{{{landmark.variable, 0, Matrix2::Identity()}}};
  return {landmark.id, landmark_at(static_cast<int>(index)), tree_.projected_covariance(itself, 2),
          landmark.sightings.size() + landmark.marginalised};
}

MatrixXd IncrementalSmoother::map_covariance(std::span<const std::size_t> landmarks) const {
  if (!past_.parts.empty()) return map_covariance_of_tree(landmarks);
  Minimiser all(problem_);
  if (problem_.landmarks == 0 || !all.linearise(problem_, state())) return {};
  std::vector<Index> rows;
  for (const std::size_t landmark : landmarks) {
    const auto row = 2 * static_cast<Index>(landmark);
    rows.insert(rows.end(), {row, row + 1});
  }
  return all.map_covariance(0, problem_.landmarks)(rows, rows);
}

MatrixXd IncrementalSmoother::map_covariance_of_tree(std::span<const std::size_t> landmarks) const {
  std::vector<EliminationTree::Derivative> derivatives;
  for (const std::size_t landmark : landmarks)
    derivatives.push_back(
        {map_.landmarks[landmark].variable, 2 * static_cast<Index>(derivatives.size()), Matrix2::Identity()});
  return tree_.projected_covariance(derivatives, 2 * static_cast<Index>(landmarks.size()));
}

PoseEstimate IncrementalSmoother::estimate_after(const SinceKeyframe& since) const {
  const Index systematic = options_.prior.systematic_sigma.size();
  PoseEstimate estimate{.pose = pose_after(since)};
  estimate.systematic = Systematic::Zero(systematic);
  if (problem_.has_bias) estimate.systematic[0] = keyframe_bias();
  const VectorXd p = parameters();
  for (std::size_t i = 0; i < free_.size(); ++i) estimate.systematic[free_[i]] = p[static_cast<Index>(i)];

  const MatrixXd P = covariance_with_systematic(since.motion);
  const Matrix3 axes = world_from_body_axes(estimate.pose);
  estimate.covariance = axes * P.topLeftCorner<3, 3>() * axes.transpose();
  estimate.with_systematic = axes * P.topRightCorner(3, systematic);
  estimate.systematic_covariance = P.bottomRightCorner(systematic, systematic);
  return estimate;
}

/// Of (e, s): what of it is of the motion since the keyframe, and what is of the keyframe, or of the prior
/// where there is none yet, and of the systematic errors.
MatrixXd IncrementalSmoother::covariance_with_systematic(const FreeMotion& motion) const {
  const Systematic& sigma = options_.prior.systematic_sigma;
  const Index numbers = 3 + sigma.size();
  MatrixXd P = MatrixXd::Zero(numbers, numbers);
  P.topLeftCorner<3, 3>() = motion.covariance;
  MatrixXd by_pose = MatrixXd::Zero(numbers, pose_size(problem_));
  by_pose.topLeftCorner<3, 3>() = adjoint(motion.mean.inverse());
  if (problem_.has_bias) {
    P.block<3, 1>(0, 3) = motion.with_walk;
    P.block<1, 3>(3, 0) = motion.with_walk.transpose();
    P(3, 3) = motion.walk;
    by_pose.block<3, 1>(0, 3) = motion.by_bias;
    by_pose(3, 3) = 1.0;
  }
  MatrixXd by_parameters = MatrixXd::Zero(numbers, static_cast<Index>(free_.size()));
  by_parameters.topRows<3>() = motion.by_parameters;
  for (std::size_t i = 0; i < free_.size(); ++i) by_parameters(3 + free_[i], static_cast<Index>(i)) = 1.0;
  if (pose_variables_.empty()) {
    const MatrixXd of_parameters = by_parameters * sigma(free_).asDiagonal();
    P += of_parameters * of_parameters.transpose();
    if (problem_.has_bias) P += sigma[0] * sigma[0] * by_pose.col(3) * by_pose.col(3).transpose();
    return P;
  }
  std::vector<EliminationTree::Derivative> derivatives{{pose_variables_.back(), 0, by_pose.transpose()}};
  if (parameter_variable_ >= 0) derivatives.push_back({parameter_variable_, 0, by_parameters.transpose()});
  return P + tree_.projected_covariance(derivatives, numbers);
}

}  // namespace trundle::slam
