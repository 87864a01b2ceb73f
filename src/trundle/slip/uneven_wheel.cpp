#include "trundle/slip/uneven_wheel.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

namespace trundle::slip {
namespace {

// The residuals' own variance is found by so many steps of iteration from their mean square.
constexpr int kSteps = 3;
constexpr double kFewest = 8.0;  // intervals

}  // namespace

void UnevenWheel::turn(const Increment& interval) {
  for (std::size_t i = 0; i < angle_.size(); ++i)
    angle_[i] = std::remainder(angle_[i] + 2.0 * kPi * interval.turned[i], 2.0 * kPi);
}

void UnevenWheel::add(const Contradiction& c, const Parity& parity) {
  const double e = c.e[0];
  squares_ += e * e;
  intervals_ += 1.0;
  for (std::size_t i = 0; i < parity.wheels(); ++i) {
    if (c.excess_sigma_m[i] == 0.0) continue;
    const double radius = 0.5 * parity.chassis().wheels()[i].diameter_m;
    const double before = angle_[i], after = before + c.travel[i] / radius;
    angle_[i] = std::remainder(after, 2.0 * kPi);
    // By how much e changes for a relative error of one sigma of ...
    const double by_travel = kRadiusSigma * c.towards(0, static_cast<Eigen::Index>(i)) / c.excess_sigma_m[i];
    const Features f = by_travel * Features{c.gyro_rad * parity.size()[2], c.travel[i],
                                            radius * (std::cos(after) - std::cos(before)),
                                            radius * (std::sin(after) - std::sin(before))};
    Eigen::Map<Normal>(fits_[i].normal.data()) += f * f.transpose();
    Eigen::Map<Features>(fits_[i].right.data()) += f * e;
  }
}

/// Marginal, of coefficients N(0, 1) and the residuals' own variance [Bishop 2006, 3.86].
double UnevenWheel::log_likelihood(const Fit& fit, int features) const {
  const Eigen::Map<const Normal> all(fit.normal.data());
  const Eigen::Map<const Features> all_right(fit.right.data());
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kFeatures, kFeatures>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kFeatures, 1>;
  const Matrix normal = all.topLeftCorner(features, features);
  const Vector right = all_right.head(features);
  double variance = squares_ / intervals_;
  Vector x(features);
  double log_determinant = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    Matrix precision = normal / variance;
    precision.diagonal().array() += 1.0;
    const Eigen::LLT<Matrix> cholesky(precision);
    x = cholesky.solve(Vector(right / variance));
    log_determinant = 2.0 * cholesky.matrixLLT().diagonal().array().log().sum();
    const double rest = squares_ - 2.0 * x.dot(right) + x.dot(normal * x);
    variance = std::max(rest, 1e-9 * squares_) / intervals_;
  }
  return -0.5 * (intervals_ * std::log(variance) + log_determinant + x.squaredNorm());
}

PerWheel UnevenWheel::probability(std::size_t wheels) const {
  PerWheel probability{};
  const auto n = static_cast<double>(wheels);
  for (std::size_t i = 0; i < wheels; ++i) probability[i] = 1.0 / n;
  if (intervals_ < kFewest || squares_ == 0.0) return probability;
  const double none = log_likelihood(fits_[0], 1);
  double most = none;
  PerWheel log_of{};
  for (std::size_t i = 0; i < wheels; ++i)
    most = std::max(most, log_of[i] = log_likelihood(fits_[i], kFeatures));
  // Where none is uneven, a radius may still be wrong: any.
  double sum = std::exp(none - most);
  for (std::size_t i = 0; i < wheels; ++i) {
    probability[i] = std::exp(none - most) / n + std::exp(log_of[i] - most);
    sum += std::exp(log_of[i] - most);
  }
  for (std::size_t i = 0; i < wheels; ++i) probability[i] /= sum;
  return probability;
}

}  // namespace trundle::slip
