#include "trundle/calibration/likelihood/information.hpp"

#include <cmath>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

// Of a matrix scaled to ones on its diagonal: below it, what is left of an eigenvalue is rounding.
constexpr double kRounding = 1e-12;

Eigen::VectorXd inverse_or_zero(const Eigen::VectorXd& values, double least) {
  return values.unaryExpr([&](double value) { return value > least ? 1.0 / value : 0.0; });
}

}  // namespace

// With A = R Rᵀ and R⁺ B R⁺ᵀ = U Λ Uᵀ it is R U (1 − Λ) Uᵀ R⁺.
Eigen::MatrixXd share_known(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  if (A.size() == 0) return A;
  const Eigen::VectorXd unit = A.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd scale = inverse_or_zero(unit, 0.0);
  const auto [values, axes] = symmetric_eigen(Eigen::MatrixXd(scale.asDiagonal() * A * scale.asDiagonal()));
  const Eigen::VectorXd root = values.cwiseMax(0.0).cwiseSqrt();
  const Eigen::MatrixXd R = unit.asDiagonal() * axes * root.asDiagonal();
  const Eigen::MatrixXd R_inverse =
      inverse_or_zero(root, std::sqrt(kRounding)).asDiagonal() * axes.transpose() * scale.asDiagonal();
  const auto [share, U] = symmetric_eigen(Eigen::MatrixXd(R_inverse * B * R_inverse.transpose()));
  const Eigen::VectorXd known = 1.0 - share.array().max(0.0).min(1.0);
  return R * U * known.asDiagonal() * U.transpose() * R_inverse;
}

void keep_what_is_known(std::span<Information> blocks) {
  if (blocks.empty()) return;
  Information sum = Information::zero(blocks.front().gradient.size());
  for (const Information& block : blocks) sum.add(block);
  if (sum.of_noise.size() == 0) return;
  const Eigen::MatrixXd K = share_known(sum.matrix, sum.of_noise);
  for (Information& block : blocks) {
    block.matrix = (K * block.matrix * K.transpose()).eval();
    block.gradient = (K * block.gradient).eval();
    block.of_noise.resize(0, 0);
  }
}

Eigen::MatrixXd information_of_noise(const Eigen::MatrixXd& W, const Eigen::MatrixXd& covariance) {
  const Eigen::Index m = W.rows(), n = covariance.rows() / m;
  Eigen::MatrixXd information(n, n);
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index k = 0; k < n; ++k)
      information(j, k) = W.cwiseProduct(covariance.block(m * j, m * k, m, m)).sum();
  return information;
}

}  // namespace trundle::calibration
