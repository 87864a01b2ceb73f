#include "trundle/slam/fastslam/loop_correction.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace trundle::slam {

std::optional<LoopCorrection> LoopCorrection::between(const Submap& old, const Submap& now,
                                                      const Move& move) {
  LoopCorrection correction;
  correction.move_ = move;
  correction.old_ = {old.frame.about(move.centre), old.drift.about(move.centre), old.keyframe};
  const Eigen::LLT<Matrix3> since(now.drift.about(move.centre).covariance - correction.old_.drift.covariance);
  if (since.info() != Eigen::Success) return std::nullopt;
  correction.root_ = since.matrixL();
  correction.whitener_ = since.matrixL().solve(Matrix3::Identity());
  const Matrix3 growth = now.frame.about(move.centre).covariance - correction.old_.frame.covariance;
  correction.growth_ = correction.whitener_ * growth * correction.whitener_.transpose();
  return correction;
}

LoopCorrection::Shares LoopCorrection::shares(const FrameCovariance& drift) const {
  const Matrix3 since = drift.about(move_.centre).covariance - old_.drift.covariance;
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(whitener_ * since * whitener_.transpose());
  return {eigen.eigenvectors(), eigen.eigenvalues().cwiseMax(0.0).cwiseMin(1.0)};
}

Matrix3 LoopCorrection::root_along(const Matrix3& axes, const Vector3& factors) const {
  return root_ * axes * factors.asDiagonal() * axes.transpose();
}

/// Eq. 66.
Matrix3 LoopCorrection::share(const FrameCovariance& drift) const {
  const auto [axes, share] = shares(drift);
  return root_along(axes, share) * whitener_;
}

Pose2 LoopCorrection::motion(const Vector3& twist) const {
  const Pose2 world_from_centre{move_.centre.x(), move_.centre.y(), 0.0};
  return world_from_centre * exp(Twist2::from(twist)) * world_from_centre.inverse();
}

Vector3 LoopCorrection::twist(const Pose2& motion) const {
  const Pose2 world_from_centre{move_.centre.x(), move_.centre.y(), 0.0};
  return log(world_from_centre.inverse() * motion * world_from_centre).vector();
}

/// Eq. 67: what both ends leave open of the growth in between, and what is wrong with the move.
FrameCovariance LoopCorrection::frame_after(const FrameCovariance& drift) const {
  const auto [axes, share] = shares(drift);
  const Matrix3 open = root_along(axes, share.cwiseProduct(Vector3::Ones() - share).cwiseSqrt());
  const Matrix3 s = root_along(axes, share) * whitener_;
  return {move_.centre,
          old_.frame.covariance + open * growth_ * open.transpose() + s * move_.covariance * s.transpose()};
}

Twists::Twists(std::span<const Vector3> of_particles) : sums_(1, Vector3::Zero()) {
  sums_.reserve(of_particles.size() + 1);
  for (const Vector3& twist : of_particles) sums_.push_back(sums_.back() + twist);
}

Vector3 Twists::mean(std::size_t first, std::size_t last) const {
  return (sums_[last] - sums_[first]) / static_cast<double>(last - first);
}

}  // namespace trundle::slam
