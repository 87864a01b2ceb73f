#include "trundle/slam/smoother/track.hpp"

#include <algorithm>
#include <map>

#include <Eigen/LU>

#include "trundle/geometry/gaussian.hpp"

namespace trundle {
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

Track::Track(const TrackInput& input, SmoothingProblem& problem)
    : time_s_(input.time_s),
      start_(input.start),
      first_pose_(problem.poses),
      first_landmark_(problem.landmarks) {
  const Eigen::Index parameters = problem.parameter_information.size();
  std::map<LandmarkId, int> number_of;
  FreeMotion since = no_motion(body_covariance(input.start, input.start_covariance), parameters);
  for (std::size_t step = 0; step < input.motions.size(); ++step) {
    since = since * input.motions[step];
    since_.push_back(since);
    next_station_.push_back(stations());
    if (!shows_something(input.observations[step])) continue;
    const int pose = problem.poses++;
    MotionLink link = link_of(station_steps_.empty() ? MotionLink::kKnown : pose - 1, pose, since);
    link.start = start_;
    problem.motions.push_back(std::move(link));
    for (const Observation& observation : input.observations[step]) {
      if (observation.landmark < 0 || !is_valid(observation)) continue;
      const auto [at, is_new] = number_of.try_emplace(observation.landmark, problem.landmarks);
      if (is_new) {
        landmarks_.push_back(observation.landmark);
        ++problem.landmarks;
      }
      problem.sightings.push_back({pose, at->second, observation});
    }
    station_steps_.push_back(step);
    since = no_motion(Matrix3::Zero(), parameters);
  }
}

Trajectory Track::at_stations(const Trajectory& trajectory) const {
  Trajectory stations;
  for (const std::size_t step : station_steps_) stations.poses.push_back(trajectory.poses[step]);
  return stations;
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

// With A, S, Q those of the motion from the station before, a, up to the step, and A', S', Q' up to the
// station after, b; B = Ad of the motion between. The step's pose moves by δ = A δa + S δp + K (δb − A' δa −
// S' δp), K = Q Bᵀ Q'⁻¹, and what remains is Q − K B Q. Eq. 12.
GaussianPose Track::at(std::size_t step, const SmoothingState& state, const Minimiser& linearised) const {
  const std::size_t next = next_station_[step];
  const int b = first_pose_ + static_cast<int>(next);
  const bool last = next == stations();
  if (!last && station_steps_[next] == step)
    return {state.poses[static_cast<std::size_t>(b)], linearised.pose_covariance(b)};

  const FreeMotion& m = since_[step];
  const bool first = next == 0;
  const Pose2& from = first ? start_ : state.poses[static_cast<std::size_t>(b - 1)];
  const Eigen::Index parameters = state.parameters.size();
  Vector3 e = Vector3::Zero();
  Matrix3 K = Matrix3::Zero();
  Matrix3 rest = m.covariance;
  Matrix3 by_a = adjoint(m.mean.inverse());
  Eigen::Matrix3Xd by_p = m.by_parameters;
  if (!last) {
    const FreeMotion& whole = motion_to(next);
    const MotionLink link = link_of(0, 0, whole);
    const Matrix3 B = adjoint(whole.mean.inverse() * m.mean);
    K = m.covariance * B.transpose() * link.information;
    rest -= K * B * m.covariance;
    e = K * motion_residual(link, from, state.poses[static_cast<std::size_t>(b)], state.parameters).error;
    by_a -= K * adjoint(whole.mean.inverse());
    by_p -= K * whole.by_parameters;
  }
  GaussianPose pose;
  pose.mean = from * m.mean * exp(Twist2::from(m.by_parameters * state.parameters + e));

  // The joint covariance of (δa, δb, δp), where there is an a and a b.
  Eigen::MatrixXd J(3, 6 + parameters);
  J << by_a, K, by_p;
  Eigen::MatrixXd joint = Eigen::MatrixXd::Zero(6 + parameters, 6 + parameters);
  if (!first) joint.topLeftCorner<3, 3>() = linearised.pose_covariance(b - 1);
  if (!last) joint.block<3, 3>(3, 3) = linearised.pose_covariance(b);
  if (!first && !last) {
    joint.block<3, 3>(0, 3) = linearised.pose_covariance(b - 1, b);
    joint.block<3, 3>(3, 0) = joint.block<3, 3>(0, 3).transpose();
  }
  if (parameters > 0) {
    if (!first) joint.block(0, 6, 3, parameters) = linearised.pose_parameter_covariance(b - 1);
    if (!last) joint.block(3, 6, 3, parameters) = linearised.pose_parameter_covariance(b);
    joint.block(6, 0, parameters, 6) = joint.block(0, 6, 6, parameters).transpose();
    joint.bottomRightCorner(parameters, parameters) = linearised.parameter_covariance();
  }
  pose.covariance = J * joint * J.transpose() + rest;
  return pose;
}

}  // namespace trundle
