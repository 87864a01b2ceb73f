#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "trundle/slam/merging/shared_frame.hpp"

namespace trundle::slam {

/// χ² of matched landmarks, the frame being the best for them: all that errs in common is in the covariances.
struct JointFit {
  Pose2 b_from_a;
  double cost = std::numeric_limits<double>::infinity();
};
[[nodiscard]] JointFit joint_fit(const JointMap& a, const JointMap& b,
                                 const std::vector<LandmarkMatch>& matches, Pose2 b_from_a);

/// Of matched landmarks, a's in the frame of b: e ≈ J · step, with the covariance of e.
struct MatchedLandmarks {
  Eigen::VectorXd e;
  Eigen::MatrixX3d J;
  Eigen::MatrixXd covariance;
};
[[nodiscard]] MatchedLandmarks matched(const JointMap& a, const JointMap& b,
                                       const std::vector<LandmarkMatch>& matches, const Pose2& b_from_a);

/// The match without which the others fit best: with Q = W − W J (Jᵀ W J)⁻¹ Jᵀ W, where W is the inverse of
/// the covariance, χ² = eᵀ Q e is less by (Q e)_iᵀ Q_ii⁻¹ (Q e)_i.
[[nodiscard]] std::size_t worst_of(const MatchedLandmarks& all);

}  // namespace trundle::slam
