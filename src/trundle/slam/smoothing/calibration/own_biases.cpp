#include "trundle/slam/smoothing/calibration/own_biases.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::slam {

using Eigen::Index;
using Eigen::VectorXd;

Index OwnBiases::count() const {
  return std::ranges::count_if(rad_s, [](const auto& one) { return one.has_value(); });
}

std::optional<Index> OwnBiases::place_of(std::size_t recording) const {
  if (recording >= rad_s.size() || !rad_s[recording]) return std::nullopt;
  return std::count_if(rad_s.begin(), rad_s.begin() + static_cast<std::ptrdiff_t>(recording),
                       [](const auto& one) { return one.has_value(); });
}

double OwnBiases::of(std::size_t recording) const {
  return recording < rad_s.size() ? rad_s[recording].value_or(0.0) : 0.0;
}

VectorXd OwnBiases::values() const {
  VectorXd values(count());
  for (std::size_t i = 0; i < rad_s.size(); ++i)
    if (const auto place = place_of(i)) values[*place] = *rad_s[i] / unit_rad_s;
  return values;
}

void OwnBiases::move(const VectorXd& units) {
  for (std::size_t i = 0; i < rad_s.size(); ++i)
    if (const auto place = place_of(i)) *rad_s[i] += unit_rad_s * units[*place];
}

GyroBiasSpread spread_of(const OwnBiases& own, const Eigen::MatrixXd& covariance, double dispersion) {
  const Index k = own.count();
  if (k == 0) return {};
  // What was seen says A, and where it is at its minimum with the prior pulls as much as that: g = Λ b.
  const VectorXd b = own.values();
  Eigen::MatrixXd A = inverse_of(covariance);
  A.diagonal().tail(k).array() -= own.information;
  A /= dispersion;
  VectorXd g = VectorXd::Zero(A.rows());
  g.tail(k) = own.information / dispersion * b;
  return most_likely_spread(own.unit_rad_s, [&](double spread_rad_s) {
    const double precision = squared(own.unit_rad_s / spread_rad_s);
    Eigen::MatrixXd with_prior = A;
    with_prior.diagonal().tail(k).array() += precision;
    VectorXd score = g;
    score.tail(k) -= precision * b;
    const auto misfit = gaussian_misfit(score, with_prior);
    if (!misfit) return std::numeric_limits<double>::infinity();
    return misfit->log_determinant - static_cast<double>(k) * std::log(precision) +
           precision * b.squaredNorm() - misfit->squared_mahalanobis;
  });
}

}  // namespace trundle::slam
