#include "trundle/slam/smoothing/track.hpp"

#include <algorithm>

#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"

namespace trundle::slam {
namespace {

bool shows_something(const std::vector<Observation>& observations) {
  return std::ranges::any_of(observations,
                             [](const Observation& o) { return o.landmark >= 0 && is_valid(o); });
}

/// A motion that goes nowhere, `parameters` of them.
FreeMotion no_motion(const Matrix3& covariance, Eigen::Index parameters) {
  return {{}, covariance, Eigen::Matrix3Xd::Zero(3, parameters)};
}

/// The keyframes between which a step lies.
struct Neighbours {
  int after;  ///< number of the pose of the problem; the one before it is that of the keyframe before
  bool has_before;
  bool has_after;
};

/// How a step moves with its neighbours and the parameters. Eq. 12.
struct Interpolation {
  Vector3 error;                          ///< twist from the motion's mean at the parameters' 0
  Matrix3 covariance;                     ///< of what remains
  Eigen::Matrix<double, 3, 4> by_before;  ///< pose and bias
  Eigen::Matrix<double, 3, 4> by_after = Eigen::Matrix<double, 3, 4>::Zero();
  Eigen::Matrix3Xd by_parameters;
};

/// By the keyframe before alone, or by the start, whose bias has a variance.
Interpolation extrapolated(const FreeMotion& m, double bias, double bias_variance) {
  Interpolation step{.error = bias * m.by_bias,
                     .covariance = m.covariance,
                     .by_before = {},
                     .by_parameters = m.by_parameters};
  step.by_before << adjoint(m.mean.inverse()), m.by_bias;
  if (bias_variance > 0.0) step.covariance += bias_variance * m.by_bias * m.by_bias.transpose();
  return step;
}

// With A, S, g, Q those of the motion from the keyframe before, a, up to the step, and A', S', g' up to the
// keyframe after, b; B = Ad of the motion between. The step's pose moves by δ = A δa + g δβ_a + S δp + K δr,
// r the residual of the whole link, K = cov(e, r) of the two motions' noise times r's information, and what
// remains is Q − K cov(r, e). Eq. 12. The bias at the start is noise of both.
void condition(const FreeMotion& m, const FreeMotion& whole, const MotionLink& link, double bias_variance,
               const SmoothingState& state, Interpolation& step) {
  const Matrix3 B = adjoint(whole.mean.inverse() * m.mean);
  const Vector3 by_bias_after = whole.by_bias - B * m.by_bias;
  Eigen::Matrix<double, 3, 4> with_r;
  with_r << m.covariance * B.transpose() + m.with_walk * by_bias_after.transpose(), m.with_walk;
  if (bias_variance > 0.0) {
    const Vector3 with_bias = bias_variance * m.by_bias;
    with_r.leftCols<3>() += with_bias * whole.by_bias.transpose();
    with_r.col(3) += with_bias;
  }
  const Eigen::Matrix<double, 3, 4> K = with_r * link.information;
  const MotionResidual r = motion_residual(link, state);
  step.covariance -= K * with_r.transpose();
  step.error += K * r.error;
  step.by_before += K * r.by_from;
  step.by_after = K * r.by_to;
  step.by_parameters -= K.leftCols<3>() * whole.by_parameters;
}

/// Of the keyframes before and after, zero where there is none, and of the parameters.
Eigen::MatrixXd joint_covariance(const Minimiser& linearised, const Neighbours& neighbours,
                                 Eigen::Index of_pose, Eigen::Index parameters) {
  const auto [b, has_before, has_after] = neighbours;
  const Eigen::Index both = 2 * of_pose;
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(both + parameters, both + parameters);
  if (has_before) joint.topLeftCorner(of_pose, of_pose) = linearised.pose_covariance(b - 1);
  if (has_after) joint.block(of_pose, of_pose, of_pose, of_pose) = linearised.pose_covariance(b);
  if (has_before && has_after) {
    joint.block(0, of_pose, of_pose, of_pose) = linearised.pose_covariance(b - 1, b);
    joint.block(of_pose, 0, of_pose, of_pose) = joint.block(0, of_pose, of_pose, of_pose).transpose();
  }
  if (parameters == 0) return joint;
  if (has_before) joint.block(0, both, of_pose, parameters) = linearised.pose_parameter_covariance(b - 1);
  if (has_after) joint.block(of_pose, both, of_pose, parameters) = linearised.pose_parameter_covariance(b);
  joint.block(both, 0, parameters, both) = joint.block(0, both, both, parameters).transpose();
  joint.bottomRightCorner(parameters, parameters) = linearised.parameter_covariance();
  return joint;
}

}  // namespace

Track::Track(const TrackInput& input, SmoothingProblem& problem, LandmarkNumbers& number_of)
    : time_s_(input.time_s),
      start_(input.start),
      first_pose_(problem.poses),
      first_landmark_(problem.landmarks) {
  const Eigen::Index parameters = problem.parameter_information.size();
  std::size_t next_also = 0;
  FreeMotion since = no_motion(body_covariance(input.start.pose, input.start_covariance), parameters);
  for (std::size_t step = 0; step < input.motions.size(); ++step) {
    since = since * input.motions[step];
    since_.push_back(since);
    next_keyframe_.push_back(keyframes());
    const bool reads = step < input.bias_readings.size() && input.bias_readings[step].has_value();
    const bool also = next_also < input.also_keyframes.size() && input.also_keyframes[next_also] == step;
    next_also += also ? 1 : 0;
    if (!reads && !also && !shows_something(input.observations[step])) continue;
    const int pose = problem.poses++;
    problem.motions.push_back(keyframe_steps_.empty() ? link_from(start_, pose, since)
                                                      : link_of(pose - 1, pose, since));
    if (reads)
      problem.bias_readings.push_back(
          {pose, input.bias_readings[step]->rad_s, input.bias_readings[step]->variance});
    for (const Observation& observation : input.observations[step]) {
      if (observation.landmark < 0 || !is_valid(observation)) continue;
      const auto [at, is_new] = number_of.try_emplace(observation.landmark, problem.landmarks);
      if (is_new) {
        landmarks_.push_back(observation.landmark);
        ++problem.landmarks;
      }
      problem.sightings.push_back({pose, at->second, observation, input.sensor});
    }
    keyframe_steps_.push_back(step);
    since = no_motion(Matrix3::Zero(), parameters);
  }
}

Trajectory Track::at_keyframes(const Trajectory& trajectory) const {
  Trajectory keyframes;
  for (const std::size_t step : keyframe_steps_) keyframes.poses.push_back(trajectory.poses[step]);
  return keyframes;
}

Trajectory Track::trajectory(const SmoothingState& state, const Minimiser& linearised) const {
  Trajectory trajectory;
  for (std::size_t step = 0; step < since_.size(); ++step) {
    const GaussianPose pose = at(step, state, linearised);
    trajectory.poses.push_back({time_s_[step], pose.mean});
    trajectory.covariances.push_back(world_covariance(pose));
  }
  return trajectory;
}

std::vector<BiasEstimate> Track::biases(const SmoothingState& state, const Minimiser& linearised) const {
  std::vector<BiasEstimate> biases;
  for (std::size_t step = 0; step < since_.size() && !state.biases.empty(); ++step) {
    const int pose = first_pose_ + static_cast<int>(std::min(next_keyframe_[step], keyframes() - 1));
    biases.push_back({state.bias_at(pose), linearised.pose_covariance(pose)(3, 3)});
  }
  return biases;
}

GaussianPose Track::at(std::size_t step, const SmoothingState& state, const Minimiser& linearised) const {
  const std::size_t next = next_keyframe_[step];
  const int b = first_pose_ + static_cast<int>(next);
  const Neighbours neighbours{b, next > 0, next < keyframes()};
  if (neighbours.has_after && keyframe_steps_[next] == step)
    return {state.poses[nth(b)], linearised.pose_covariance(b).topLeftCorner<3, 3>()};

  const FreeMotion& m = since_[step];
  const Pose2& from = neighbours.has_before ? state.poses[nth(b - 1)] : start_.pose;
  Interpolation between = neighbours.has_before ? extrapolated(m, state.bias_at(b - 1), 0.0)
                                                : extrapolated(m, start_.bias, start_.bias_variance);
  if (neighbours.has_after) {
    const FreeMotion& whole = motion_to(next);
    if (neighbours.has_before)
      condition(m, whole, link_of(b - 1, b, whole), 0.0, state, between);
    else
      condition(m, whole, link_from(start_, b, whole), start_.bias_variance, state, between);
  }
  const Eigen::Index of_pose = state.biases.empty() ? 3 : 4;
  Eigen::MatrixXd J(3, 2 * of_pose + state.parameters.size());
  J << between.by_before.leftCols(of_pose), between.by_after.leftCols(of_pose), between.by_parameters;
  const Eigen::MatrixXd joint = joint_covariance(linearised, neighbours, of_pose, state.parameters.size());
  return {from * m.mean * exp(Twist2::from(m.by_parameters * state.parameters + between.error)),
          J * joint * J.transpose() + between.covariance};
}

}  // namespace trundle::slam
