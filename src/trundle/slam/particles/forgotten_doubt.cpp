#include "trundle/slam/particles/forgotten_doubt.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Eigenvalues>

namespace trundle {
namespace {

// Enough to tell a shift from a turn, and to know how much of each there is: more would cost time and change
// nothing.
constexpr std::size_t kLandmarks = 4;
constexpr std::size_t kParticles = 128;

template <class Real>
bool all_have(const LandmarkColumns& columns, std::size_t particles) {
  const Real* xx = columns.numbers<Real>() + 2 * columns.stride();
  return std::all_of(xx, xx + particles, [](Real variance) { return variance >= Real{0}; });
}

bool all_have(const LandmarkColumns& columns, std::size_t particles) {
  return columns.precision() == Precision::float32 ? all_have<float>(columns, particles)
                                                   : all_have<double>(columns, particles);
}

/// Where some of the particles have a landmark, from the origin of its columns.
template <class Real>
void take_places(const LandmarkColumns& columns, std::size_t stride, std::vector<Vector2>& places) {
  const Real* x = columns.numbers<Real>();
  const Real* y = x + columns.stride();
  for (std::size_t i = 0; i < places.size(); ++i)
    places[i] = {static_cast<double>(x[i * stride]), static_cast<double>(y[i * stride])};
}

}  // namespace

MapDoubt MapDoubt::about(const Vector2& other) const {
  Matrix3 A = Matrix3::Identity();
  A(0, 2) = centre.y() - other.y();
  A(1, 2) = other.x() - centre.x();
  return {other, A * covariance * A.transpose()};
}

/// Least squares: for each particle the shift and turn that take the mean of the maps to its own.
std::optional<MapDoubt> map_scatter(std::span<const LandmarkColumns* const> candidates,
                                    std::size_t particles) {
  std::vector<const LandmarkColumns*> landmarks;
  for (const LandmarkColumns* candidate : candidates)
    if (landmarks.size() < kLandmarks && all_have(*candidate, particles)) landmarks.push_back(candidate);
  if (landmarks.size() < 2) return std::nullopt;
  const std::size_t stride = (particles + kParticles - 1) / kParticles;
  const std::size_t taken = (particles + stride - 1) / stride;
  std::vector<std::vector<Vector2>> places(landmarks.size(), std::vector<Vector2>(taken));
  std::vector<Vector2> means(landmarks.size(), Vector2::Zero());
  MapDoubt result;
  for (std::size_t j = 0; j < landmarks.size(); ++j) {
    const LandmarkColumns& columns = *landmarks[j];
    columns.precision() == Precision::float32 ? take_places<float>(columns, stride, places[j])
                                              : take_places<double>(columns, stride, places[j]);
    for (const Vector2& place : places[j]) means[j] += place / static_cast<double>(taken);
    result.centre += (columns.origin() + means[j]) / static_cast<double>(landmarks.size());
  }
  std::vector<Vector3> moves(taken, Vector3::Zero());
  double arms = 0.0;
  for (std::size_t j = 0; j < landmarks.size(); ++j) {
    const Vector2 arm = landmarks[j]->origin() + means[j] - result.centre;
    arms += arm.squaredNorm();
    for (std::size_t i = 0; i < taken; ++i) {
      const Vector2 apart = places[j][i] - means[j];
      moves[i] += Vector3(apart.x(), apart.y(), arm.x() * apart.y() - arm.y() * apart.x());
    }
  }
  const double share = 1.0 / static_cast<double>(landmarks.size());
  const Vector3 shares(share, share, arms > 0.0 ? 1.0 / arms : 0.0);
  for (Vector3& move : moves) {
    move = move.cwiseProduct(shares).eval();
    result.covariance += move * move.transpose() / static_cast<double>(taken);
  }
  return result;
}

Kinship::Kinship(std::size_t particles) : lag_(std::clamp<std::size_t>(particles / 5, 1, 20)) {}

void Kinship::hold(Ancestry& ancestry) {
  ancestry.hold(ancestry.now());
  epochs_.push_back(ancestry.now());
}

double Kinship::share_lost(Ancestry& ancestry) {
  constexpr double kMost = 0.5;  // where all are kin there is nothing to count
  const double kinship = ancestry.kinship(epochs_.front());
  const double lost = 1.0 - std::pow(1.0 - kinship, 1.0 / static_cast<double>(epochs_.size()));
  if (epochs_.size() == lag_) {
    ancestry.release(epochs_.front());
    epochs_.erase(epochs_.begin());
  }
  return std::min(lost, kMost);
}

/// Eq. 61.
MapDoubt ForgottenDoubt::forget(const MapDoubt& left, double share) {
  forgotten_ = forgotten_.about(left.centre);
  forgotten_.covariance += share / (1.0 - share) * left.covariance;
  return {left.centre, forgotten_.covariance + left.covariance};
}

/// Eq. 62: twice, for the particles have lost it, and their mean has moved by as much.
Matrix3 ForgottenDoubt::beyond_scatter(const Vector2& position) const {
  return 2.0 * forgotten_.about(position).covariance;
}

/// What the particles still differ in may be more than it was then, along some direction: nothing is
/// forgotten there.
Matrix2 beyond_scatter(const Matrix2& whole, const Matrix2& scatter) {
  const Eigen::SelfAdjointEigenSolver<Matrix2> eigen(whole - scatter);
  const auto& V = eigen.eigenvectors();
  return 2.0 * V * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() * V.transpose();
}

}  // namespace trundle
