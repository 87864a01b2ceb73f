#include "trundle/calibration/likelihood/run_parameters.hpp"

#include <cmath>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::calibration {
namespace {

/// Of their priors.
Eigen::VectorXd precision_of(std::span<const OwnParameter> own) {
  Eigen::VectorXd precision(static_cast<Eigen::Index>(own.size()));
  for (std::size_t i = 0; i < own.size(); ++i)
    precision[static_cast<Eigen::Index>(i)] = 1.0 / (own[i].prior_sigma * own[i].prior_sigma);
  return precision;
}

Eigen::VectorXd moved_of(std::span<const OwnParameter> own) {
  Eigen::VectorXd moved(static_cast<Eigen::Index>(own.size()));
  for (std::size_t i = 0; i < own.size(); ++i) moved[static_cast<Eigen::Index>(i)] = own[i].moved;
  return moved;
}

/// Jᵀ W J of the own parameters, their priors included.
Eigen::MatrixXd information_of_own(const Information& with_own, std::span<const OwnParameter> own) {
  const auto k = static_cast<Eigen::Index>(own.size());
  Eigen::MatrixXd N = with_own.matrix.bottomRightCorner(k, k);
  N.diagonal() += precision_of(own);
  return N;
}

}  // namespace

std::vector<Parameter> with_own(std::span<const Parameter> parameters, std::span<const OwnParameter> own) {
  std::vector<Parameter> all(parameters.begin(), parameters.end());
  for (const OwnParameter& one : own)
    if (one.parameter) all.push_back(*one.parameter);
  return all;
}

OwnStep own_step(const Information& with_own, std::span<const OwnParameter> own) {
  const auto k = static_cast<Eigen::Index>(own.size());
  const Eigen::Index n = with_own.gradient.size() - k;
  OwnStep step{.step = {}, .covariance = inverse_of(information_of_own(with_own, own)), .follows = {}};
  step.step = step.covariance * (with_own.gradient.tail(k) - precision_of(own).cwiseProduct(moved_of(own)));
  step.follows = -step.covariance * with_own.matrix.bottomLeftCorner(k, n);
  return step;
}

std::vector<Information> without_own(const std::vector<Information>& blocks,
                                     std::span<const OwnParameter> own) {
  if (own.empty() || blocks.empty()) return blocks;
  const auto k = static_cast<Eigen::Index>(own.size());
  Information sum = Information::zero(blocks.front().gradient.size());
  for (const Information& block : blocks) sum.add(block);
  const Eigen::Index n = sum.gradient.size() - k;
  const OwnStep own_best = own_step(sum, own);
  Eigen::MatrixXd T(n + k, n);
  T << Eigen::MatrixXd::Identity(n, n), own_best.follows;

  std::vector<Information> result;
  for (const Information& block : blocks) {
    const Eigen::VectorXd gradient = block.gradient - block.matrix.rightCols(k) * own_best.step;
    result.push_back({.matrix = congruent(block.matrix, T),
                      .gradient = T.transpose() * gradient,
                      .chi2 = block.chi2 - own_best.step.dot(block.gradient.tail(k) + gradient.tail(k)),
                      .count = block.count});
  }
  // That of the priors: one residual more for each.
  const Eigen::VectorXd from_prior = moved_of(own) + own_best.step;
  Information prior = Information::zero(n);
  prior.add(own_best.follows, precision_of(own).asDiagonal(), (-from_prior).eval());
  result.push_back(std::move(prior));
  return result;
}

double log_determinant_of_own(const Information& with_own, std::span<const OwnParameter> own) {
  const Eigen::VectorXd whitening = precision_of(own).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd N = information_of_own(with_own, own);
  double sum = 0.0;
  for (const double value : symmetric_eigenvalues(whitening.asDiagonal() * N * whitening.asDiagonal()))
    sum += std::log(value);
  return sum;
}

}  // namespace trundle::calibration
