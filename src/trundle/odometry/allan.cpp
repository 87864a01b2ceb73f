#include "trundle/odometry/allan.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "trundle/statistics/distribution.hpp"

namespace trundle::odometry {
namespace {

constexpr double kFewestDegrees = 3.0;  // a deviation is then known within 1/√6 = 41 %, 1σ

/// Of the overlapping variance over m of n integrals: the smaller of those for white noise and for a random
/// walk [Riley 2008, table 5.4.1]. Where both are in the samples the truth lies between them.
double degrees_of_freedom(double n, double m) {
  const double white = (1.5 * (n - 1.0) / m - 2.0 * (n - 2.0) / n) * 4.0 * m * m / (4.0 * m * m + 5.0);
  const double walk =
      (n - 2.0) / m * ((n - 1.0) * (n - 1.0) - 3.0 * m * (n - 1.0) + 4.0 * m * m) / ((n - 3.0) * (n - 3.0));
  return std::min(white, walk);
}

/// Σ (θ_{k+2m} − 2 θ_{k+m} + θ_k)² over one stretch, and how many there are.
struct SecondDifferences {
  double squares = 0.0;
  double count = 0.0;
  double degrees = 0.0;

  void add(const std::vector<double>& integral, std::size_t m) {
    const std::size_t n = integral.size();
    if (n < 2 * m + 1 || n < 4) return;
    for (std::size_t k = 0; k + 2 * m < n; ++k) {
      const double difference = integral[k + 2 * m] - 2.0 * integral[k + m] + integral[k];
      squares += difference * difference;
    }
    count += static_cast<double>(n - 2 * m);
    degrees += std::max(0.0, degrees_of_freedom(static_cast<double>(n), static_cast<double>(m)));
  }
};

/// Running sums of the deviations from the mean, which keeps them small.
std::vector<double> integral_of(const std::vector<double>& samples, double step_s) {
  double mean = 0.0;
  for (const double sample : samples) mean += sample / static_cast<double>(samples.size());
  std::vector<double> integral = {0.0};
  for (const double sample : samples) integral.push_back(integral.back() + (sample - mean) * step_s);
  return integral;
}

using Design = Eigen::Matrix<double, Eigen::Dynamic, 2>;

/// (N², K²) and its covariance.
struct Solution {
  Eigen::Vector2d value = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// Neighbouring octaves share data: their variances correlate by 0.5 where white noise makes them and by 0.85
/// where a walk does, those k octaves apart by the k-th power of that (found by simulation).
double correlation(double share_of_walk, Eigen::Index octaves) {
  return std::pow(0.5 + 0.35 * share_of_walk, static_cast<double>(octaves));
}

/// Least squares with the weights of independent points, and the covariance that it has where they correlate.
Solution solve(const Design& X, const Eigen::VectorXd& y, const Eigen::VectorXd& model,
               const Eigen::VectorXd& degrees) {
  const Eigen::VectorXd sigma = model.array() * (2.0 / degrees.array()).sqrt();
  const Design W = sigma.cwiseAbs2().cwiseInverse().asDiagonal() * X;
  const Eigen::Matrix2d inverse = (X.transpose() * W).inverse();
  Solution solution{inverse * (W.transpose() * y), {}};
  const Eigen::VectorXd walk = X.col(1) * std::max(0.0, solution.value[1]);
  const Eigen::VectorXd share = walk.cwiseQuotient(model).cwiseMin(1.0);
  Eigen::MatrixXd S(y.size(), y.size());
  for (Eigen::Index i = 0; i < y.size(); ++i)
    for (Eigen::Index k = 0; k < y.size(); ++k)
      S(i, k) = sigma[i] * sigma[k] * correlation(0.5 * (share[i] + share[k]), std::abs(i - k));
  solution.covariance = inverse * W.transpose() * S * W * inverse;
  return solution;
}

/// K² that a walk has at most, with 99 %, if it leaves no more than that at the longest averaging time.
double most_walk_at(const AllanPoint& point) {
  const double least = chi_squared_limit(0.99, point.degrees_of_freedom) / point.degrees_of_freedom;
  return 3.0 * point.deviation * point.deviation / least / point.tau_s;
}

/// No model of white noise and a walk: white noise that is nowhere too small.
void take_most_noise(std::span<const AllanPoint> points, NoiseFit& fit) {
  fit.density = 0.0;
  for (const AllanPoint& point : points)
    if (const double density = point.deviation * std::sqrt(point.tau_s); density > fit.density) {
      fit.density = density;
      fit.density_sigma = density / std::sqrt(2.0 * point.degrees_of_freedom);
    }
}

double root(double square) {
  return std::sqrt(std::max(0.0, square));
}

}  // namespace

std::vector<AllanPoint> allan_deviation(std::span<const std::vector<double>> stretches, double step_s) {
  std::vector<std::vector<double>> integrals;
  for (const std::vector<double>& samples : stretches) integrals.push_back(integral_of(samples, step_s));
  std::vector<AllanPoint> points;
  for (std::size_t m = 1;; m *= 2) {
    SecondDifferences sum;
    for (const std::vector<double>& integral : integrals) sum.add(integral, m);
    if (sum.degrees < kFewestDegrees) return points;
    const double tau = static_cast<double>(m) * step_s;
    points.push_back({tau, std::sqrt(sum.squares / (2.0 * tau * tau * sum.count)), sum.degrees});
  }
}

std::optional<NoiseFit> fit_noise(std::span<const AllanPoint> points) {
  if (points.size() < 2) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(points.size());
  Design X(n, 2);
  Eigen::VectorXd y(n), degrees(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const AllanPoint& point = points[static_cast<std::size_t>(i)];
    X.row(i) << 1.0 / point.tau_s, point.tau_s / 3.0;
    y[i] = point.deviation * point.deviation;
    degrees[i] = point.degrees_of_freedom;
  }
  if (y.maxCoeff() <= 0.0) return NoiseFit{};
  // A variance with d degrees of freedom scatters by 2 σ⁴/d, with σ² that of the model: a fixed point.
  Eigen::VectorXd model = y.cwiseMax(1e-6 * y.maxCoeff());
  Solution solution;
  for (int round = 0; round < 20; ++round) {
    solution = solve(X, y, model, degrees);
    model = (X * solution.value.cwiseMax(0.0)).cwiseMax(1e-6 * y.maxCoeff());
  }
  const double walk2_sigma = std::sqrt(solution.covariance(1, 1));
  NoiseFit fit;
  // Where no white noise shows, all of the shortest averaging time's scatter counts as white: never zero.
  fit.density = solution.value[0] > 0.0 ? root(solution.value[0])
                                        : points.front().deviation * std::sqrt(points.front().tau_s);
  if (fit.density > 0.0) fit.density_sigma = 0.5 * std::sqrt(solution.covariance(0, 0)) / fit.density;
  fit.walk_limit = root(std::max(0.0, solution.value[1]) + 1.645 * walk2_sigma);
  const double most = most_walk_at(points.back());
  if (most < solution.value[1]) {  // correlated noise at short times looks like the foot of a walk
    fit.walk_limit = root(most);
    take_most_noise(points, fit);
  } else if (solution.value[1] > 2.0 * walk2_sigma) {
    fit.walk = root(solution.value[1]);
    fit.walk_sigma = 0.5 * walk2_sigma / *fit.walk;
  }
  return fit;
}

}  // namespace trundle::odometry
