#include "trundle/slam/merging/joint_fit.hpp"

#include <cmath>

#include <Eigen/LU>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

Eigen::MatrixXd covariance_of(const JointMap& map, const std::vector<std::size_t>& which) {
  std::vector<Index> rows;
  for (const std::size_t i : which) {
    rows.push_back(2 * static_cast<Index>(i));
    rows.push_back(2 * static_cast<Index>(i) + 1);
  }
  return map.covariance(rows, rows);
}

}  // namespace

MatchedLandmarks matched(const JointMap& a, const JointMap& b, const std::vector<LandmarkMatch>& matches,
                         const Pose2& b_from_a) {
  std::vector<std::size_t> of_a, of_b;
  for (const LandmarkMatch& match : matches) {
    of_a.push_back(match.a);
    of_b.push_back(match.b);
  }
  const Eigen::MatrixXd P_a = covariance_of(a, of_a), P_b = covariance_of(b, of_b);
  const Index n = P_a.rows();
  const Matrix2 R = rotation(b_from_a.heading);
  MatchedLandmarks all{Eigen::VectorXd(n), Eigen::MatrixX3d(n, 3),
                       P_b + kLeastMapVariance * Eigen::MatrixXd::Identity(n, n)};
  for (Index i = 0; i < n; i += 2) {
    const LandmarkMatch& match = matches[static_cast<std::size_t>(i / 2)];
    const Vector2 turned = R * a.positions[match.a];
    all.e.segment<2>(i) = turned + b_from_a.translation() - b.positions[match.b];
    all.J.block<2, 3>(i, 0) << 1.0, 0.0, -turned.y(), 0.0, 1.0, turned.x();
    for (Index k = 0; k < n; k += 2)
      all.covariance.block<2, 2>(i, k) += R * P_a.block<2, 2>(i, k) * R.transpose();
  }
  return all;
}

JointFit joint_fit(const JointMap& a, const JointMap& b, const std::vector<LandmarkMatch>& matches,
                   Pose2 b_from_a) {
  JointFit fit{b_from_a};
  for (int round = 0; round < kMostMergeRounds; ++round) {
    const MatchedLandmarks all = matched(a, b, matches, b_from_a);
    Eigen::MatrixXd right(all.e.size(), 4);
    right << all.J, all.e;
    const Eigen::MatrixXd solved = solve_ldlt_columns(all.covariance, right);
    const Vector3 step =
        -inverse_of(all.J.transpose() * solved.leftCols<3>()) * (all.J.transpose() * solved.col(3));
    if (!step.allFinite()) return fit;
    fit = {b_from_a, all.e.dot(solved.col(3)) + step.dot(all.J.transpose() * solved.col(3))};
    b_from_a = {b_from_a.x + step.x(), b_from_a.y + step.y(), b_from_a.heading + step.z()};
    fit.b_from_a = b_from_a;
    if (step.norm() < 1e-9) break;
  }
  return fit;
}

std::size_t worst_of(const MatchedLandmarks& all) {
  const Eigen::MatrixXd W = inverse_of(all.covariance);
  const Eigen::MatrixX3d W_J = W * all.J;
  const Eigen::MatrixXd Q = W - W_J * inverse_of(all.J.transpose() * W_J) * W_J.transpose();
  const Eigen::VectorXd Q_e = Q * all.e;
  Index worst = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (Index i = 0; i < Q_e.size(); i += 2) {
    const Vector2 own = Q_e.segment<2>(i);
    const double less = own.dot(Q.block<2, 2>(i, i).inverse() * own);
    if (!(less > most)) continue;
    most = less;
    worst = i;
  }
  return static_cast<std::size_t>(worst / 2);
}

}  // namespace trundle::slam
