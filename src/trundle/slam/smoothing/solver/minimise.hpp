#pragma once

#include <Eigen/Core>

#include "trundle/slam/smoothing/solver/block_cholesky.hpp"
#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"

namespace trundle::slam {

struct MinimiseOptions {
  int most_iterations = 100;
  double enough = 1e-4;  ///< the cost, a χ², that a further step is expected to gain
};

/// A minimum of a smoothing problem.
struct Minimum {
  SmoothingState state;
  double cost = 0.0;
  int iterations = 0;  ///< linear systems that were solved
  bool converged = false;
};

/// Solves smoothing problems of one pattern: Levenberg-Marquardt with an exact sparse factorization for each
/// step. docs/theory/smoother.md, eq. 7-8.
class Minimiser {
 public:
  explicit Minimiser(const SmoothingProblem& problem);

  /// `problem` may differ from the constructor's in its numbers, not in which links there are.
  Minimum minimise(const SmoothingProblem& problem, SmoothingState start,
                   const MinimiseOptions& options = {});

  /// Covariances at a state, all others integrated out; each by its own move: pose · exp(δ), landmark + δ,
  /// parameter + δ. False when the problem leaves something undetermined there.
  bool linearise(const SmoothingProblem& problem, const SmoothingState& state);
  /// Of a pose, where there is one with the bias there; `other`: one that a motion links with it.
  Eigen::MatrixXd pose_covariance(int pose) const { return normal_.inverse(pose, pose); }
  Eigen::MatrixXd pose_covariance(int pose, int other) const { return normal_.inverse(pose, other); }
  Eigen::MatrixXd pose_parameter_covariance(int pose) const { return normal_.inverse(pose, parameters_); }
  Matrix2 landmark_covariance(int landmark) const {
    return normal_.inverse(poses_ + landmark, poses_ + landmark);
  }
  /// Of a pose and a landmark that a sighting links with it.
  Eigen::MatrixXd pose_landmark_covariance(int pose, int landmark) const {
    return normal_.inverse(pose, poses_ + landmark);
  }
  /// Of problems whose sensor errs.
  Eigen::MatrixXd landmark_parameter_covariance(int landmark) const {
    return normal_.inverse(poses_ + landmark, parameters_);
  }
  /// Of all landmarks from one on, x and y of each: two solutions of the linear system for each.
  Eigen::MatrixXd map_covariance(int first, int count) const;
  /// Of the difference of two landmarks' positions.
  Matrix2 difference_covariance(int landmark, int other) const;
  Eigen::MatrixXd parameter_covariance() const;

  /// x with A x = b, A being the normal matrix where it was linearised; where each unknown stands in b.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const { return normal_.solve(b); }
  Eigen::Index unknowns() const { return normal_.size(); }
  Eigen::Index row_of_pose(int pose) const { return normal_.offset(pose); }
  Eigen::Index row_of_landmark(int landmark) const { return normal_.offset(poses_ + landmark); }
  Eigen::Index row_of_parameters() const { return normal_.offset(parameters_); }

 private:
  class LevenbergMarquardt;

  struct Equations;

  void build(const SmoothingProblem& problem, const SmoothingState& state);
  SmoothingState moved(const SmoothingState& state, const Eigen::VectorXd& step) const;

  int poses_;
  Eigen::Index of_pose_;  ///< numbers of a pose: three, and the bias there
  int landmarks_;
  int parameters_;     ///< block of the parameters
  Eigen::Index free_;  ///< how many parameters
  BlockCholesky normal_;
  Eigen::VectorXd gradient_;  ///< Jᵀ W e
};

}  // namespace trundle::slam
