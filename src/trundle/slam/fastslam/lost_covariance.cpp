#include "trundle/slam/fastslam/lost_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::slam {

FrameCovariance FrameCovariance::about(const Vector2& other) const {
  Matrix3 A = Matrix3::Identity();
  A(0, 2) = centre.y() - other.y();
  A(1, 2) = other.x() - centre.x();
  return {other, A * covariance * A.transpose()};
}

namespace {

/// Axes along which two covariances are independent: the one is 1 along each, the other `variances`.
struct CommonAxes {
  Matrix3 axes;
  Vector3 variances;

  Matrix3 along(const Vector3& of_axes) const { return axes * of_axes.asDiagonal() * axes.transpose(); }
};
/// Nothing where the one has no extent, along some direction.
std::optional<CommonAxes> common_axes(const Matrix3& one, const Matrix3& other) {
  const Eigen::LLT<Matrix3> root(one);
  if (root.info() != Eigen::Success) return std::nullopt;
  const Matrix3 whitener = root.matrixL().solve(Matrix3::Identity());
  const Eigen::SelfAdjointEigenSolver<Matrix3> eigen(whitener * other * whitener.transpose());
  return CommonAxes{root.matrixL() * eigen.eigenvectors(), eigen.eigenvalues()};
}

/// Eq. 68: a Kalman filter of what has come about since, whose mean is not moved.
FrameCovariance updated(const FrameCovariance& prior, const FrameCovariance& old,
                        const LostCovariance::Fit& fit) {
  const FrameCovariance now = prior.about(fit.seen);
  const auto common = common_axes(now.covariance, old.about(fit.seen).covariance);
  if (!common) return prior;
  const Vector3 before = common->variances.cwiseMin(1.0);
  const Matrix3 since = common->axes * (Vector3::Ones() - before).cwiseSqrt().asDiagonal();
  const Eigen::Matrix<double, 2, 3> shift = since.topRows<2>();
  const Eigen::Matrix<double, 3, 2> by_residual = 2.0 * shift.transpose() * fit.covariance.inverse();
  const Matrix3 left = (Matrix3::Identity() + by_residual * shift).inverse();
  const Vector3 off = since * left * by_residual * fit.residual;
  return {fit.seen, common->along(before) + since * left * since.transpose() + 0.5 * off * off.transpose()};
}

}  // namespace

std::vector<Vector2> some_places(const LandmarkColumns& columns, std::span<const Ancestry::Index> ancestors,
                                 std::size_t particles) {
  // Of a covariance: its entries are then known to √(2/128) = 12 %.
  constexpr std::size_t kEnough = 128;
  const std::size_t stride = (particles + kEnough - 1) / kEnough;
  std::vector<Vector2> places;
  places.reserve(kEnough);
  for (std::size_t i = 0; i < particles; i += stride) {
    const LandmarkEstimate m = columns.at(ancestors[i]);
    if (!is_there(m)) return {};
    places.emplace_back(m.x, m.y);
  }
  return places;
}

/// Least squares: for each particle the shift and turn that take the mean of the maps to its own.
std::optional<FrameCovariance> map_scatter(std::span<const std::vector<Vector2>> landmarks) {
  if (landmarks.size() < 2) return std::nullopt;
  const std::size_t particles = landmarks.front().size();
  std::vector<Vector2> means;
  for (const std::vector<Vector2>& places : landmarks)
    means.push_back(std::accumulate(places.begin(), places.end(), Vector2(Vector2::Zero())) / particles);
  FrameCovariance result;
  for (const Vector2& mean : means) result.centre += mean / landmarks.size();
  std::vector<Vector3> moves(particles, Vector3::Zero());
  double arms = 0.0;
  for (std::size_t j = 0; j < landmarks.size(); ++j) {
    const Vector2 arm = means[j] - result.centre;
    arms += arm.squaredNorm();
    for (std::size_t i = 0; i < particles; ++i) {
      const Vector2 apart = landmarks[j][i] - means[j];
      moves[i] += Vector3(apart.x(), apart.y(), arm.x() * apart.y() - arm.y() * apart.x());
    }
  }
  const double share = 1.0 / static_cast<double>(landmarks.size());
  const Vector3 shares(share, share, arms > 0.0 ? 1.0 / arms : 0.0);
  for (const Vector3& sum : moves) {
    const Vector3 move = sum.cwiseProduct(shares);
    result.covariance += move * move.transpose() / static_cast<double>(particles);
  }
  return result;
}

Coalescence::Coalescence(std::size_t particles) : lag_(std::clamp<std::size_t>(particles / 5, 1, 20)) {}

void Coalescence::hold(Ancestry& ancestry) {
  ancestry.hold(ancestry.now());
  epochs_.push_back(ancestry.now());
}

double Coalescence::share_lost(Ancestry& ancestry) {
  // Where all descend from one the count says nothing: no resampling takes more than half of a variance, that
  // is what it takes where every particle has two descendants or none.
  constexpr double kMost = 0.5;
  const double coalesced = ancestry.coalescence_probability(epochs_.front());
  const double lost = 1.0 - std::pow(1.0 - coalesced, 1.0 / static_cast<double>(epochs_.size()));
  if (epochs_.size() == lag_) {
    ancestry.release(epochs_.front());
    epochs_.erase(epochs_.begin());
  }
  return std::min(lost, kMost);
}

/// Eq. 61.
FrameCovariance LostCovariance::after_resampling(const FrameCovariance& scatter, double share) {
  lost_ = lost_.about(scatter.centre);
  lost_.covariance += share / (1.0 - share) * scatter.covariance;
  return total_ = {scatter.centre, lost_.covariance + scatter.covariance};
}

void LostCovariance::inflate(const FrameCovariance& more) {
  lost_ = lost_.about(more.centre);
  total_ = total_.about(more.centre);
  lost_.covariance += more.covariance;
  total_.covariance += more.covariance;
}

void LostCovariance::update(const FrameCovariance& old, const Fit& fit) {
  lost_ = updated(lost_, old, fit);
  total_ = updated(total_, old, fit);
}

void LostCovariance::inflate_to(const FrameCovariance& old, const Vector2& centre) {
  const auto common = common_axes(total_.about(centre).covariance, old.about(centre).covariance);
  if (common) inflate({centre, common->along((common->variances - Vector3::Ones()).cwiseMax(0.0))});
}

void LostCovariance::reset(const FrameCovariance& lost, const FrameCovariance& total) {
  lost_ = lost;
  total_ = total;
}

/// Eq. 62: twice, for the particles have lost it, and their mean has moved by as much.
Matrix3 LostCovariance::beyond_scatter(const Vector2& position) const {
  return 2.0 * lost_.about(position).covariance;
}

/// What the particles still differ in may be more than it was then, along some direction: nothing is
/// lost there.
Matrix2 beyond_scatter(const Matrix2& total, const Matrix2& scatter) {
  const SymmetricEigen eigen = symmetric_eigen(total - scatter);
  const Matrix2 V = eigen.vectors;
  const Vector2 variances = eigen.values;
  return 2.0 * V * variances.cwiseMax(0.0).asDiagonal() * V.transpose();
}

}  // namespace trundle::slam
