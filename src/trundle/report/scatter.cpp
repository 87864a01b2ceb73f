#include "trundle/report/scatter.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::report {
namespace {

Vector2 mean_of(std::span<const Vector2> points) {
  Vector2 sum = Vector2::Zero();
  for (const Vector2& point : points) sum += point;
  return points.empty() ? sum : Vector2(sum / static_cast<double>(points.size()));
}

Matrix2 sample_covariance(std::span<const Vector2> points, const Vector2& mean) {
  Matrix2 sum = Matrix2::Zero();
  for (const Vector2& point : points) sum += (point - mean) * (point - mean).transpose();
  return sum / static_cast<double>(points.size() - 1);
}

/// F_p(2, m) has a closed form: m/2 ((1 − p)^(−2/m) − 1).
double f_quantile_95(double m) {
  return 0.5 * m * (std::pow(0.05, -2.0 / m) - 1.0);
}

double prediction_radius(double n) {
  return std::sqrt(2.0 * (n - 1.0) * (n + 1.0) / (n * (n - 2.0)) * f_quantile_95(n - 2.0));
}

/// Of an axis, which has no sign: in (−π/2, π/2].
double axis_angle(const Vector2& axis) {
  const double angle = std::atan2(axis.y(), axis.x());
  return angle > kPi / 2.0 ? angle - kPi : (angle <= -kPi / 2.0 ? angle + kPi : angle);
}

/// All points at most c sigmas from the mean.
Ellipse ellipse_of(const Vector2& mean, const Matrix2& covariance, double c) {
  const SymmetricEigen axes = symmetric_eigen(covariance);
  const Vector2 variances = axes.values;
  const Vector2 sigma = variances.cwiseMax(0.0).cwiseSqrt();
  return {mean, c * sigma(1), c * sigma(0), axis_angle(axes.vectors.col(1))};
}

}  // namespace

Ellipse error_ellipse95(const Vector2& mean, const Matrix2& covariance) {
  return ellipse_of(mean, covariance, std::sqrt(kChiSquared2At95));
}

Scatter scatter_of(std::span<const Vector2> points) {
  Scatter scatter{static_cast<int>(points.size()), mean_of(points), {}};
  if (scatter.count >= kFewestForEllipse)
    scatter.ellipse95 = ellipse_of(scatter.centroid, sample_covariance(points, scatter.centroid),
                                   prediction_radius(static_cast<double>(scatter.count)));
  return scatter;
}

}  // namespace trundle::report
