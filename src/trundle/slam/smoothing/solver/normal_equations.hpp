#pragma once

#include <concepts>

#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"

namespace trundle::slam {

// What each part of a smoothing problem adds to the normal equations Λ δ = b, linearised at a state: Jᵀ W J
// and −Jᵀ W e. docs/theory/smoother.md, eq. 7.

/// Where it goes: blocks of a matrix, of which one triangle counts, and of the right side; and which block is
/// whose. Without parameters parameter_block() is not asked for.
template <class T>
concept NormalEquations = requires(T& equations, int i, const Eigen::MatrixXd& block,
                                   const Eigen::VectorXd& part) {
  equations.add(i, i, block);
  equations.add(i, part);
  { equations.pose_block(i) } -> std::convertible_to<int>;
  { equations.landmark_block(i) } -> std::convertible_to<int>;
  { equations.parameter_block() } -> std::convertible_to<int>;
};

/// A pose has three numbers, and its bias where there is one.
inline Eigen::Index pose_size(const SmoothingProblem& problem) {
  return problem.has_bias ? 4 : 3;
}

template <NormalEquations T>
void add_to(T& equations, const MotionLink& link, const SmoothingProblem& problem,
            const SmoothingState& state) {
  const bool known = link.from == MotionLink::kKnown;
  const Eigen::Index n = pose_size(problem);
  const MotionResidual r = motion_residual(link, state);
  const Eigen::Matrix4d W_to = link.information * r.by_to;
  const Eigen::Vector4d We = link.information * r.error;
  const Eigen::Vector4d g_to = r.by_to.transpose() * We;
  const int to = equations.pose_block(link.to);
  equations.add(to, to, (r.by_to.transpose() * W_to).topLeftCorner(n, n));
  equations.add(to, -g_to.head(n));
  if (!known) {
    const Eigen::Vector4d g_from = r.by_from.transpose() * We;
    const int from = equations.pose_block(link.from);
    equations.add(from, from, (r.by_from.transpose() * link.information * r.by_from).topLeftCorner(n, n));
    equations.add(from, to, (r.by_from.transpose() * W_to).topLeftCorner(n, n));
    equations.add(from, -g_from.head(n));
  }
  if (problem.parameter_information.size() == 0) return;
  const int parameters = equations.parameter_block();
  const Eigen::Matrix4Xd W_by = -link.information.leftCols<3>() * link.by_parameters;
  equations.add(parameters, parameters, -link.by_parameters.transpose() * W_by.topRows<3>());
  equations.add(to, parameters, (r.by_to.transpose() * W_by).topRows(n));
  if (!known)
    equations.add(equations.pose_block(link.from), parameters, (r.by_from.transpose() * W_by).topRows(n));
  equations.add(parameters, link.by_parameters.transpose() * We.head<3>());
}

/// What a residual says of the parameters by what its sensor errs by. Returns how it depends on them so,
/// times its weight.
template <NormalEquations T, class Residual>
Eigen::Matrix2Xd add_sensor_to(T& equations, int sensor, const Residual& r, double weight,
                               const SmoothingProblem& problem) {
  const int parameters = equations.parameter_block();
  const Eigen::Matrix2Xd by_parameters = through_errors_of(sensor, problem, r.by_sensor);
  Eigen::Matrix2Xd W_by = weight * by_parameters;
  equations.add(parameters, parameters, by_parameters.transpose() * W_by);
  equations.add(parameters, -W_by.transpose() * r.error);
  return W_by;
}

template <NormalEquations T>
void add_to(T& equations, const SightingLink& link, const SmoothingProblem& problem,
            const SmoothingState& state) {
  const SightingResidual r = sighting_residual(problem, link, state);
  const double weight = robust_weight(r.error.squaredNorm(), problem.gate);
  const int pose = equations.pose_block(link.pose);
  const int landmark = equations.landmark_block(link.landmark);
  equations.add(pose, pose, weight * r.by_pose.transpose() * r.by_pose);
  equations.add(landmark, landmark, weight * r.by_landmark.transpose() * r.by_landmark);
  equations.add(landmark, pose, weight * r.by_landmark.transpose() * r.by_pose);
  equations.add(pose, -weight * r.by_pose.transpose() * r.error);
  equations.add(landmark, -weight * r.by_landmark.transpose() * r.error);
  if (problem.sensor_errors.empty()) return;
  const int parameters = equations.parameter_block();
  const Eigen::Matrix2Xd W_by = add_sensor_to(equations, link.sensor, r, weight, problem);
  equations.add(pose, parameters, r.by_pose.transpose() * W_by);
  equations.add(landmark, parameters, r.by_landmark.transpose() * W_by);
}

template <NormalEquations T>
void add_to(T& equations, const RobotLink& link, const SmoothingProblem& problem,
            const SmoothingState& state) {
  const RobotResidual r = robot_residual(problem, link, state);
  const double weight = robust_weight(r.error.squaredNorm(), problem.gate);
  const Eigen::Index n = pose_size(problem);
  Eigen::Matrix<double, 2, 4> by_pose = Eigen::Matrix<double, 2, 4>::Zero(), by_seen = by_pose;
  by_pose.leftCols<3>() = r.by_pose;
  by_seen.leftCols<3>() = r.by_seen;
  const int pose = equations.pose_block(link.pose);
  const int seen = equations.pose_block(link.seen);
  equations.add(pose, pose, (weight * by_pose.transpose() * by_pose).topLeftCorner(n, n));
  equations.add(seen, seen, (weight * by_seen.transpose() * by_seen).topLeftCorner(n, n));
  equations.add(pose, seen, (weight * by_pose.transpose() * by_seen).topLeftCorner(n, n));
  equations.add(pose, -weight * (by_pose.transpose() * r.error).head(n));
  equations.add(seen, -weight * (by_seen.transpose() * r.error).head(n));
  if (problem.sensor_errors.empty()) return;
  const int parameters = equations.parameter_block();
  const Eigen::Matrix2Xd W_by = add_sensor_to(equations, link.sensor, r, weight, problem);
  equations.add(pose, parameters, (by_pose.transpose() * W_by).topRows(n));
  equations.add(seen, parameters, (by_seen.transpose() * W_by).topRows(n));
}

template <NormalEquations T>
void add_to(T& equations, const PositionLink& link, const SmoothingProblem& problem,
            const SmoothingState& state) {
  const PositionResidual r = position_residual(link, state);
  const double weight = robust_weight(r.error.squaredNorm(), problem.gate);
  const Eigen::Index n = pose_size(problem);
  Eigen::Matrix<double, 2, 4> by_pose = Eigen::Matrix<double, 2, 4>::Zero();
  by_pose.leftCols<3>() = r.by_pose;
  const int pose = equations.pose_block(link.pose);
  equations.add(pose, pose, (weight * by_pose.transpose() * by_pose).topLeftCorner(n, n));
  equations.add(pose, -weight * (by_pose.transpose() * r.error).head(n));
}

template <NormalEquations T>
void add_to(T& equations, const BiasLink& link, const SmoothingProblem&, const SmoothingState& state) {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  information(3, 3) = 1.0 / link.variance;
  const int pose = equations.pose_block(link.pose);
  equations.add(pose, pose, information);
  equations.add(pose,
                Eigen::Vector4d(0.0, 0.0, 0.0, (link.value - state.bias_at(link.pose)) / link.variance));
}

/// What is known of the parameters beforehand, and what else is.
template <NormalEquations T>
void add_parameters_to(T& equations, const SmoothingProblem& problem, const SmoothingState& state) {
  if (problem.parameter_information.size() == 0) return;
  const int parameters = equations.parameter_block();
  equations.add(parameters, parameters, Eigen::MatrixXd(problem.parameter_information.asDiagonal()));
  const Eigen::VectorXd off =
      problem.parameter_mean.size() == 0 ? state.parameters : state.parameters - problem.parameter_mean;
  equations.add(parameters, -problem.parameter_information.cwiseProduct(off));
  const Information& evidence = problem.parameter_evidence;
  if (evidence.count == 0) return;
  equations.add(parameters, parameters, evidence.matrix);
  equations.add(parameters, evidence.gradient - evidence.matrix * state.parameters);
}

}  // namespace trundle::slam
