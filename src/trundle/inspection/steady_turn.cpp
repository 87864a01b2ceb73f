#include "trundle/inspection/steady_turn.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace trundle::inspection {
namespace {

constexpr int kFewestPieces = 20;
constexpr double kCollinear = 1e-9;  // of unit columns: what they do not tell apart comes out with a large σ

}  // namespace

void SteadyTurns::add(const Twist2& by_wheels, double turn_rad, double duration_s) {
  constexpr double kPiece_s = 0.5;  // as TurnPairs has it
  piece_ += Eigen::Vector4d(duration_s, by_wheels.dx, by_wheels.dtheta, turn_rad);
  if (piece_[0] < kPiece_s) return;
  moments_ += piece_ * piece_.transpose();
  duration_s_ += piece_[0];
  ++pieces_;
  piece_.setZero();
}

std::optional<SteadyTurn> SteadyTurns::turn() const {
  if (pieces_ < kFewestPieces || !moments_.allFinite()) return std::nullopt;
  const Eigen::Vector4d unit = moments_.diagonal().unaryExpr(
      [](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 1.0; });
  Eigen::Matrix4d scaled = unit.asDiagonal() * moments_ * unit.asDiagonal();
  scaled.diagonal().array() += kCollinear;
  const Eigen::Matrix3d inverse = scaled.topLeftCorner<3, 3>().llt().solve(Eigen::Matrix3d::Identity());
  const Eigen::Vector3d coefficients = inverse * scaled.topRightCorner<3, 1>();
  const double left = scaled(3, 3) - coefficients.dot(scaled.topRightCorner<3, 1>());
  const double to_rate = unit[0] / unit[3];

  // Both turns beside time and way.
  const Eigen::Matrix2d others = scaled.topLeftCorner<2, 2>();
  const Eigen::Matrix2d shared = scaled.topRightCorner<2, 2>();
  const Eigen::Matrix2d beside =
      scaled.bottomRightCorner<2, 2>() - shared.transpose() * others.llt().solve(shared);
  const double norms = std::sqrt(std::max(0.0, beside(0, 0) * beside(1, 1)));
  return SteadyTurn{.rate_rad_s = coefficients[0] * to_rate,
                    .sigma_rad_s = to_rate * std::sqrt(std::max(0.0, left) / (pieces_ - 3) * inverse(0, 0)),
                    .duration_s = duration_s_,
                    .correlation = norms > 0.0 ? beside(0, 1) / norms : 0.0};
}

}  // namespace trundle::inspection
