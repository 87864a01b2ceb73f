#include "trundle/calibration/noise/growth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include "trundle/calibration/run_likelihood.hpp"
#include "trundle/odometry/odometer.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::calibration {
namespace {

// A variance from n differences is known to √(2/n): to a third.
constexpr std::size_t kFewestPairs = 20;
// Of ten intervals the longest lag, 3/16, spans two: with fewer all lags are one interval.
constexpr std::size_t kFewestEpochsForLags = 11;
// Differences larger than so many robust sigmas (by chance 2e-9) are lost tracking, not wobble: they count as
// that much.
constexpr double kLargestDeviation = 6.0;

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

/// Reference minus free-running odometry, of one quantity along one run, as far as the reference goes on.
struct Drift {
  std::vector<double> path_m;
  std::vector<double> error;
  double model_variance = 0.0;  ///< of odometry at the end for the noise it was run with

  void add(double path, double value) {
    path_m.push_back(path);
    error.push_back(value);
  }
};

/// Of x and y [m] and of the heading [rad].
using Drifts = std::array<Drift, 3>;

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

Drifts drifts_from(const Pose2& start, const Run& run, const Piece& piece, const Robot& robot) {
  Drifts drifts;
  auto& [x, y, heading] = drifts;
  Odometer odometer(robot, {.start = start});
  double path = 0.0;
  std::size_t done = run.epochs[piece.first];
  for (std::size_t epoch = piece.first; epoch < piece.end; ++epoch) {
    for (; done < run.epochs[epoch]; ++done) {
      const Increment increment = run.readings.increments[done];
      odometer.step(increment);
      path += mean_travel(robot.chassis, increment);
    }
    const ReferenceSample sample =
        sample_reference(run.reference, run.epoch_time(epoch) - robot.reference_time_offset_s);
    const Pose2 sensor = odometer.pose() * robot.body_from_reference;
    if (sample.has_position()) {
      x.add(path, sample.value.x() - sensor.x);
      y.add(path, sample.value.y() - sensor.y);
    }
    if (sample.has_heading())
      heading.add(path, unwrap_angle(sample.value.z() - sensor.heading,
                                     heading.error.empty() ? 0.0 : heading.error.back()));
  }
  const Vector3 variance = odometer.white_covariance().diagonal();
  for (std::size_t i = 0; i < 3; ++i) drifts[i].model_variance = variance[static_cast<Eigen::Index>(i)];
  return drifts;
}

/// An error of the start heading swings the whole piece, and would pass for noise that grows: the mean of all
/// headings shows it better than the first of them.
Drifts drifts_of(const Run& run, const Piece& piece, const Robot& robot) {
  Pose2 start = body_at(run, piece.first, robot);
  Drifts drifts = drifts_from(start, run, piece, robot);
  const std::vector<double>& error = drifts[2].error;
  if (!robot.chassis.gyro || error.empty()) return drifts;
  start.heading += std::accumulate(error.begin(), error.end(), 0.0) / static_cast<double>(error.size());
  return drifts_from(start, run, piece, robot);
}

/// One point of the variogram.
struct LagVariance {
  double lag_m = 0.0;
  double variance = 0.0;
  double weight = 0.0;
};

std::vector<LagVariance> variogram(std::span<const Drift> drifts) {
  double longest = 0.0;
  for (const Drift& e : drifts)
    if (!e.path_m.empty()) longest = std::max(longest, e.path_m.back() - e.path_m.front());
  std::vector<LagVariance> points;
  if (longest <= 0.0) return points;  // it stood
  // Longer lags are no use: the fitted parameters have already bent the odometry to the reference over them.
  for (const double share : {1.0 / 64, 1.0 / 32, 1.0 / 16, 3.0 / 32, 1.0 / 8, 3.0 / 16}) {
    const double lag = share * longest;
    std::vector<double> differences;
    double lags = 0.0;
    for (const Drift& e : drifts) {
      std::size_t j = 0;
      for (std::size_t i = 0; i < e.path_m.size(); ++i) {
        while (j < e.path_m.size() && e.path_m[j] < e.path_m[i] + lag) ++j;
        if (j == e.path_m.size()) break;
        if (j == i) continue;
        differences.push_back(e.error[j] - e.error[i]);
        lags += e.path_m[j] - e.path_m[i];
      }
    }
    if (differences.size() < kFewestPairs) continue;
    const double mean_lag = lags / static_cast<double>(differences.size());
    const double variance = mean_square(differences);
    // Stretches that do not overlap are what counts as independent evidence.
    points.push_back({mean_lag, variance, 1.0 / share});
  }
  return points;
}

struct Line {
  double intercept = 0.0;
  double slope = 0.0;
};

/// Weighted least squares with both coefficients non-negative.
Line fit_line(const std::vector<LagVariance>& points) {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const LagVariance& p : points) {
    w += p.weight;
    x += p.weight * p.lag_m;
    y += p.weight * p.variance;
    xx += p.weight * p.lag_m * p.lag_m;
    xy += p.weight * p.lag_m * p.variance;
  }
  const double slope = (w * xy - x * y) / (w * xx - x * x);
  const double intercept = (y - slope * x) / w;
  if (slope < 0.0) return {y / w, 0.0};
  if (intercept < 0.0) return {0.0, xy / xx};
  return {intercept, slope};
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
  return Growth{std::sqrt(line.slope * path / std::max(model, 1e-30)), std::sqrt(0.5 * line.intercept)};
}

struct RunDrifts {
  std::vector<Drift> position;  ///< x and y of every piece
  std::vector<Drift> heading;
};

RunDrifts drifts_of(std::span<const Run> runs, const Robot& robot) {
  RunDrifts all;
  for (const Run& run : runs) {
    if (run.epochs.empty()) continue;
    for (const Piece& piece : pieces_of(run)) {
      Drifts drifts = drifts_of(run, piece, robot);
      all.position.push_back(std::move(drifts[0]));
      all.position.push_back(std::move(drifts[1]));
      all.heading.push_back(std::move(drifts[2]));
    }
  }
  return all;
}

}  // namespace

std::optional<Growth> growth_of_position(std::span<const Run> runs, const Robot& robot) {
  return growth_of(drifts_of(runs, robot).position);
}

std::optional<Growth> growth_of_heading(std::span<const Run> runs, const Robot& robot) {
  return growth_of(drifts_of(runs, robot).heading);
}

bool have_lags(std::span<const Run> runs) {
  return std::ranges::any_of(runs, [](const Run& run) { return run.epochs.size() >= kFewestEpochsForLags; });
}

}  // namespace trundle::calibration
