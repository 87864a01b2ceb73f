#include "trundle/calibration/noise/growth.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "trundle/calibration/likelihood/run_likelihood.hpp"
#include "trundle/calibration/problem/problem.hpp"
#include "trundle/geometry/decompositions.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::calibration {
namespace {

// A variance from n differences is known to √(2/n): to a third.
constexpr std::size_t kFewestPairs = 20;
// Differences larger than so many robust sigmas (by chance 2e-9) are lost tracking, not wobble: they count as
// that much.
constexpr double kLargestDeviation = 6.0;
// Of what turns headings, beside what turns them most: that much is none, for wheels without noise too.
constexpr double kNegligibleTurn = 1e-12;

/// Mean square, with outliers cut.
double mean_square(std::vector<double>& values) {
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  const double limit = kLargestDeviation * kSigmaOfMedian * *middle;
  double sum = 0.0;
  for (const double v : values) sum += std::min(v, limit) * std::min(v, limit);
  return sum / static_cast<double>(values.size());
}

/// By how much the reference's heading is further than that of free-running odometry, along one piece of a
/// run.
struct Drift {
  std::vector<double> path_m;
  std::vector<double> error_rad;
  double model_variance = 0.0;  ///< of odometry at the end for the noise it was run with
  /// By the parameters, and then by combinations of them that turn headings independently of each other: a
  /// row for each point.
  Eigen::MatrixXd by_parameters;

  void add(double path, double value, const Eigen::RowVectorXd& sensitivity) {
    by_parameters.row(static_cast<Eigen::Index>(path_m.size())) = sensitivity;
    path_m.push_back(path);
    error_rad.push_back(value);
  }
  double length_m() const { return path_m.empty() ? 0.0 : path_m.back() - path_m.front(); }
};

/// Epochs between two jumps of the reference.
struct Piece {
  std::size_t first = 0;
  std::size_t end = 0;
};

std::vector<Piece> pieces_of(const Run& run) {
  std::vector<Piece> pieces{{0, run.epochs.size()}};
  for (const std::size_t jump : run.jumps) {
    pieces.back().end = jump;
    pieces.push_back({jump, run.epochs.size()});
  }
  return pieces;
}

Drift drift_of(const Run& run, const Piece& piece, const Robot& robot,
               std::span<const Parameter> parameters) {
  Drift drift;
  drift.by_parameters.resize(static_cast<Eigen::Index>(piece.end - piece.first),
                             static_cast<Eigen::Index>(parameters.size()));
  Odometer odometer(robot, {.start = body_at(run, piece.first, robot),
                            .parameters = {parameters.begin(), parameters.end()},
                            .rates_change = true});
  double path_m = 0.0, last_rad = 0.0;
  std::size_t done = run.epochs[piece.first];
  for (std::size_t epoch = piece.first; epoch < piece.end; ++epoch) {
    for (; done < run.epochs[epoch]; ++done)
      path_m += mean_travel(robot.chassis, step_along(run, done, odometer));
    const ReferenceSample sample =
        sample_reference(run.reference, run.epoch_time(epoch) - robot.reference_time_offset_s);
    if (!sample.has_heading()) continue;
    const double heading_rad = (odometer.pose() * robot.body_from_reference).heading;
    last_rad = unwrap_angle(sample.value.z() - heading_rad, last_rad);
    drift.add(path_m, last_rad, odometer.sensitivity().row(2));
  }
  drift.by_parameters.conservativeResize(static_cast<Eigen::Index>(drift.path_m.size()), Eigen::NoChange);
  drift.model_variance = odometer.white_covariance()(2, 2);
  return drift;
}

/// Makes the columns of `by_parameters` independent: of a walk of the headings, a fit by parameters of these
/// priors leaves what is orthogonal to them. docs/theory/calibration-noise.md, eq. 8a.
void make_independent(const Eigen::VectorXd& prior_sigmas, std::span<Drift> drifts) {
  const Eigen::Index n = prior_sigmas.size();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  double variance = 0.0, path_m = 0.0;
  for (const auto& [path, error, model_variance, by_parameters] : drifts) {
    variance += model_variance;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const double step_m = path[i] - path[i - 1];
      if (!(step_m > 0.0)) continue;
      const auto k = static_cast<Eigen::Index>(i);
      const Eigen::RowVectorXd turned =
          (by_parameters.row(k) - by_parameters.row(k - 1)).cwiseProduct(prior_sigmas.transpose());
      information += turned.transpose() * turned / step_m;
      path_m += step_m;
    }
  }
  if (n == 0 || !(path_m > 0.0)) return;
  const SymmetricEigen eigen = symmetric_eigen(information);
  const double growth = std::max(variance / path_m, kNegligibleTurn * eigen.values.maxCoeff());
  const Eigen::VectorXd scale = (eigen.values.array().max(0.0) + growth).sqrt().inverse();
  const Eigen::MatrixXd independent = prior_sigmas.asDiagonal() * eigen.vectors * scale.asDiagonal();
  for (Drift& drift : drifts) drift.by_parameters = (drift.by_parameters * independent).eval();
}

/// One point of the variogram.
struct LagVariance {
  double lag_m = 0.0;  ///< less what the fit has bent away of a walk over it
  double variance = 0.0;
  double stretches = 0.0;  ///< so many that do not overlap: what counts as independent evidence
};

double longest_path(std::span<const Drift> drifts) {
  double longest_m = 0.0;
  for (const Drift& drift : drifts) longest_m = std::max(longest_m, drift.length_m());
  return longest_m;
}

/// From each epoch to the first that is so far on. Nothing where there are too few.
std::optional<LagVariance> variance_over(double lag_m, std::span<const Drift> drifts) {
  std::vector<double> differences;
  double lags_m = 0.0, path_m = 0.0, bent_m = 0.0;
  for (const auto& [path, error, model_variance, bent] : drifts) {
    const std::size_t before = differences.size();
    for (std::size_t i = 0, j = 0; i < path.size(); ++i) {
      while (j < path.size() && path[j] < path[i] + lag_m) ++j;
      if (j == path.size()) break;
      if (j == i) continue;
      differences.push_back(error[j] - error[i]);
      lags_m += path[j] - path[i];
      bent_m +=
          (bent.row(static_cast<Eigen::Index>(j)) - bent.row(static_cast<Eigen::Index>(i))).squaredNorm();
    }
    if (differences.size() > before) path_m += path.back() - path.front();
  }
  if (differences.size() < kFewestPairs) return std::nullopt;
  const auto count = static_cast<double>(differences.size());
  return LagVariance{(lags_m - bent_m) / count, mean_square(differences), path_m / (lags_m / count)};
}

std::vector<LagVariance> variogram(std::span<const Drift> drifts) {
  const double longest_m = longest_path(drifts);
  std::vector<LagVariance> points;
  if (longest_m <= 0.0) return points;  // it stood
  // Longer lags are no use: the fitted parameters have already bent the odometry to the reference over them.
  for (const double share : {1.0 / 64, 1.0 / 32, 1.0 / 16, 3.0 / 32, 1.0 / 8, 3.0 / 16})
    if (const auto point = variance_over(share * longest_m, drifts);
        point && (points.empty() || point->lag_m != points.back().lag_m))  // else from the same pairs
      points.push_back(*point);
  return points;
}

/// Neither coefficient is negative.
struct Line {
  double intercept = 0.0;
  double slope = 0.0;
  double possible_slope = 0.0;  ///< its mean, given that it is not negative
};

/// Mean of a normal distribution of which only what is not negative is possible.
double mean_not_negative(double mean, double sigma) {
  if (sigma <= 0.0) return std::max(mean, 0.0);
  const double z = std::max(mean / sigma, -30.0);  // beyond, exp and erfc are zero
  return sigma * (z + std::sqrt(2.0 / std::numbers::pi) * std::exp(-0.5 * z * z) /
                          std::erfc(-z * std::numbers::sqrt2 / 2.0));
}

/// Weighted least squares. docs/theory/calibration-noise.md, eq. 8b.
Line fit_line(const std::vector<LagVariance>& points) {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const LagVariance& p : points) {
    w += p.stretches;
    x += p.stretches * p.lag_m;
    y += p.stretches * p.variance;
    xx += p.stretches * p.lag_m * p.lag_m;
    xy += p.stretches * p.lag_m * p.variance;
  }
  const double determinant = w * xx - x * x;
  const double slope = (w * xy - x * y) / determinant;
  if (slope > 0.0 && y < slope * x) return {0.0, xy / xx, xy / xx};
  Line line{y / w, 0.0, 0.0};
  if (slope > 0.0) line = {(y - slope * x) / w, slope, 0.0};
  double variance = 0.0;  // of the slope: the relative one of each point is 2 / stretches
  for (const LagVariance& p : points) {
    const double share = (w * p.lag_m - x) * p.stretches / determinant;
    const double expected = line.intercept + line.slope * p.lag_m;
    variance += share * share * expected * expected * 2.0 / p.stretches;
  }
  line.possible_slope = mean_not_negative(slope, std::sqrt(variance));
  return line;
}

/// Eq. 8.
std::optional<Growth> growth_of(std::span<const Drift> drifts) {
  const std::vector<LagVariance> points = variogram(drifts);
  if (points.size() < 3) return std::nullopt;
  const Line line = fit_line(points);
  double model = 0.0;
  double path = 0.0;
  for (const Drift& drift : drifts) {
    model += drift.model_variance;
    if (!drift.path_m.empty()) path += drift.path_m.back();
  }
  const double per_slope = path / std::max(model, 1e-30);
  return Growth{std::sqrt(line.slope * per_slope), std::sqrt(line.possible_slope * per_slope),
                std::sqrt(0.5 * line.intercept)};
}

}  // namespace

std::optional<Growth> growth_of_heading(std::span<const Run> runs, const Robot& robot,
                                        std::span<const Parameter> fitted) {
  std::vector<Drift> drifts;
  for (const Run& run : runs)
    if (!run.epochs.empty())
      for (const Piece& piece : pieces_of(run)) drifts.push_back(drift_of(run, piece, robot, fitted));
  make_independent(prior_sigmas(fitted, robot), drifts);
  return growth_of(drifts);
}

}  // namespace trundle::calibration
