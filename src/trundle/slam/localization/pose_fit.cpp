#include "trundle/slam/localization/pose_fit.hpp"

#include <cmath>
#include <vector>

#include <Eigen/LU>

#include "trundle/geometry/rigid_motion.hpp"

namespace trundle::slam {
namespace {

// Rounds of Gauss–Newton: the alignment is off by the readings' errors, and a round leaves of that the
// square.
constexpr int kGaussNewtonRounds = 2;

}  // namespace

// Eq. 47: q = Rᵀ(m − p).
PointInnovation point_innovation(const Pose2& map_from_body, const PointMatch& match) {
  const Matrix2 Rt = rotation(-map_from_body.heading);
  const Vector2 expected = Rt * (match.in_map - map_from_body.translation());
  PointInnovation innovation;
  innovation.residual = match.in_body - expected;
  innovation.H << -Rt, Vector2(expected.y(), -expected.x());
  innovation.noise = match.in_body_covariance + Rt * match.in_map_covariance * Rt.transpose();
  return innovation;
}

std::optional<PoseFit> fit_pose(std::span<const PointMatch> matches) {
  std::vector<PointPair> places;
  for (const PointMatch& match : matches) places.push_back({match.in_body, match.in_map});
  const std::optional<Pose2> start = rigid_motion(places);
  if (!start) return std::nullopt;
  PoseFit fit{.map_from_body = *start};
  Pose2& pose = fit.map_from_body;
  for (int round = 0; round < kGaussNewtonRounds; ++round) {
    Matrix3 information = Matrix3::Zero();
    Vector3 gradient = Vector3::Zero();
    fit.misfit = fit.log_noise = 0.0;
    for (const PointMatch& match : matches) {
      const auto [residual, H, noise] = point_innovation(pose, match);
      const Matrix2 weight = noise.inverse();
      information += H.transpose() * weight * H;
      gradient += H.transpose() * weight * residual;
      fit.misfit += residual.dot(weight * residual);
      fit.log_noise += std::log(noise.determinant());
    }
    fit.covariance = information.inverse();
    const Vector3 change = fit.covariance * gradient;
    fit.misfit -= change.dot(gradient);
    pose = {pose.x + change.x(), pose.y + change.y(), pose.heading + change.z()};
  }
  return fit;
}

}  // namespace trundle::slam
