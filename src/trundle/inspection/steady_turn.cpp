#include "trundle/inspection/steady_turn.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "trundle/recording/turns.hpp"

namespace trundle::inspection {
namespace {

constexpr int kFewestPieces = 20;
constexpr double kCollinear = 1e-9;  // of unit columns: what they do not tell apart comes out with a large σ

}  // namespace

void SteadyTurns::add(const Twist2& by_wheels, double turn_rad, double duration_s) {
  Vector5 interval;
  interval << duration_s, by_wheels.dx, by_wheels.dy, by_wheels.dtheta, turn_rad;
  piece_ += interval;
  if (piece_[0] < kPieceOfTurns_s) return;
  sum_ += piece_;
  moments_ += piece_ * piece_.transpose();
  ++pieces_;
  piece_.setZero();
}

PairedSums SteadyTurns::pairs() const {
  return {.xx = moments_(3, 3), .yy = moments_(4, 4), .xy = moments_(3, 4)};
}

double SteadyTurns::of_a_bias_s() const {
  return std::sqrt(moments_(0, 0));
}

std::optional<SteadyTurn> SteadyTurns::turn() const {
  if (pieces_ < kFewestPieces || !moments_.allFinite()) return std::nullopt;
  const Vector5 unit = moments_.diagonal().unaryExpr(
      [](double square) { return square > 0.0 ? 1.0 / std::sqrt(square) : 1.0; });
  Matrix5 scaled = unit.asDiagonal() * moments_ * unit.asDiagonal();
  scaled.diagonal().array() += kCollinear;
  const Eigen::Matrix4d inverse = scaled.topLeftCorner<4, 4>().llt().solve(Eigen::Matrix4d::Identity());
  const Eigen::Vector4d coefficients = inverse * scaled.topRightCorner<4, 1>();
  const double left = scaled(4, 4) - coefficients.dot(scaled.topRightCorner<4, 1>());
  const double to_rate = unit[0] / unit[4];

  // Both turns beside time and ways.
  const Eigen::Matrix<double, 3, 2> shared = scaled.topRightCorner<3, 2>();
  const Eigen::Matrix2d beside = scaled.bottomRightCorner<2, 2>() -
                                 shared.transpose() * scaled.topLeftCorner<3, 3>().llt().solve(shared);
  const double norms = std::sqrt(std::max(0.0, beside(0, 0) * beside(1, 1)));
  const double correlation = norms > 0.0 ? beside(0, 1) / norms : 0.0;
  const double by_rest = to_rate * std::sqrt(std::max(0.0, left) / (pieces_ - 4) * inverse(0, 0));
  const double by_wheels_noise = (1.0 - correlation * correlation) * sum_[3] / sum_[0];
  return SteadyTurn{.rate_rad_s = coefficients[0] * to_rate,
                    .sigma_rad_s = std::hypot(by_rest, by_wheels_noise),
                    .duration_s = sum_[0],
                    .correlation = correlation,
                    .wheels_turn_rad = std::sqrt(std::max(0.0, beside(0, 0))) / unit[3]};
}

}  // namespace trundle::inspection
