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

// With A, S, g, Q those of the motion from the keyframe before, a, up to the step, and A', S', g' up to the
// keyframe after, b; B = Ad of the motion between. The step's pose moves by δ = A δa + g δβ_a + S δp + K δr,
// r the residual of the whole link, K = cov(e, r) of the two motions' noise times r's information, and what
// remains is Q − K cov(r, e). Eq. 12.
GaussianPose Track::at(std::size_t step, const SmoothingState& state, const Minimiser& linearised) const {
  const std::size_t next = next_keyframe_[step];
  const int b = first_pose_ + static_cast<int>(next);
  const bool last = next == keyframes();
  if (!last && keyframe_steps_[next] == step)
    return {state.poses[nth(b)], linearised.pose_covariance(b).topLeftCorner<3, 3>()};

  const bool first = next == 0;
  const FreeMotion& m = since_[step];
  const FreeMotion& whole = last ? m : motion_to(next);
  const Pose2& from = first ? start_.pose : state.poses[nth(b - 1)];
  const Eigen::Index of_pose = state.biases.empty() ? 3 : 4;
  const Eigen::Index parameters = state.parameters.size();
  Vector3 e = (first ? start_.bias : state.bias_at(b - 1)) * m.by_bias;
  Matrix3 rest = m.covariance;
  Eigen::Matrix<double, 3, 4> by_a;
  Eigen::Matrix<double, 3, 4> by_b = Eigen::Matrix<double, 3, 4>::Zero();
  by_a << adjoint(m.mean.inverse()), m.by_bias;
  Eigen::Matrix3Xd by_p = m.by_parameters;
  if (first) rest += start_.bias_variance * m.by_bias * m.by_bias.transpose();
  if (!last) {
    const MotionLink link = first ? link_from(start_, b, whole) : link_of(b - 1, b, whole);
    const Matrix3 B = adjoint(whole.mean.inverse() * m.mean);
    const Vector3 by_bias_after = whole.by_bias - B * m.by_bias;
    Eigen::Matrix<double, 3, 4> with_r;
    with_r << m.covariance * B.transpose() + m.with_walk * by_bias_after.transpose(), m.with_walk;
    if (first) {  // the bias at the start is noise of both
      const Vector3 with_bias = start_.bias_variance * m.by_bias;
      with_r.leftCols<3>() += with_bias * whole.by_bias.transpose();
      with_r.col(3) += with_bias;
    }
    const Eigen::Matrix<double, 3, 4> K = with_r * link.information;
    const MotionResidual r = motion_residual(link, state);
    rest -= K * with_r.transpose();
    e += K * r.error;
    by_a += K * r.by_from;
    by_b = K * r.by_to;
    by_p -= K.leftCols<3>() * whole.by_parameters;
  }
  GaussianPose pose;
  pose.mean = from * m.mean * exp(Twist2::from(m.by_parameters * state.parameters + e));

  // The joint covariance of (δa, δb, δp), where there is an a and a b.
  const Eigen::Index both = 2 * of_pose;
  Eigen::MatrixXd J(3, both + parameters);
  J << by_a.leftCols(of_pose), by_b.leftCols(of_pose), by_p;
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(both + parameters, both + parameters);
  if (!first) joint.topLeftCorner(of_pose, of_pose) = linearised.pose_covariance(b - 1);
  if (!last) joint.block(of_pose, of_pose, of_pose, of_pose) = linearised.pose_covariance(b);
  if (!first && !last) {
    joint.block(0, of_pose, of_pose, of_pose) = linearised.pose_covariance(b - 1, b);
    joint.block(of_pose, 0, of_pose, of_pose) = joint.block(0, of_pose, of_pose, of_pose).transpose();
  }
  if (parameters > 0) {
    if (!first) joint.block(0, both, of_pose, parameters) = linearised.pose_parameter_covariance(b - 1);
    if (!last) joint.block(of_pose, both, of_pose, parameters) = linearised.pose_parameter_covariance(b);
    joint.block(both, 0, parameters, both) = joint.block(0, both, both, parameters).transpose();
    joint.bottomRightCorner(parameters, parameters) = linearised.parameter_covariance();
  }
  pose.covariance = J * joint * J.transpose() + rest;
  return pose;
}

}  // namespace trundle::slam
