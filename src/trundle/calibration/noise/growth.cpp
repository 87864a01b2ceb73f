#include "trundle/calibration/noise/growth.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
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

/// Where free-running odometry goes, against the reference, at the epochs of a piece.
struct FreeRun {
  std::vector<Pose2> body;
  std::vector<ReferenceSample> reference;
  std::vector<double> path_m, time_s;
  Vector3 variance = Vector3::Zero();  ///< at the end, of the noise it was run with
};

FreeRun free_run(const Run& run, const Piece& piece, const Robot& robot) {
  FreeRun free;
  Odometer odometer(robot, {.start = body_at(run, piece.first, robot)});
  double path_m = 0.0;
  std::size_t done = run.epochs[piece.first];
  for (std::size_t epoch = piece.first; epoch < piece.end; ++epoch) {
    for (; done < run.epochs[epoch]; ++done) {
      const Increment increment = run.readings.increments[done];
      odometer.step(increment);
      path_m += mean_travel(robot.chassis, increment);
    }
    const double time_s = run.epoch_time(epoch);
    free.body.push_back(odometer.pose());
    free.reference.push_back(sample_reference(run.reference, time_s - robot.reference_time_offset_s));
    free.path_m.push_back(path_m);
    free.time_s.push_back(time_s);
  }
  free.variance = odometer.white_covariance().diagonal();
  return free;
}

/// By how much the reference's heading is further, at each epoch; NaN where it has none.
std::vector<double> heading_differences(const FreeRun& free, const Robot& robot) {
  std::vector<double> differences;
  double last = 0.0;
  for (std::size_t i = 0; i < free.body.size(); ++i) {
    const bool is_known = free.reference[i].has_heading();
    if (is_known)
      last = unwrap_angle(free.reference[i].value.z() - (free.body[i] * robot.body_from_reference).heading,
                          last);
    differences.push_back(is_known ? last : kNotMeasured);
  }
  return differences;
}

/// What the gyro's walk is of those differences, the rest being the reference's noise: the fixed-interval
/// smoother [Rauch, Tung & Striebel 1965] of one number. docs/theory/calibration-noise.md, eq. 8a.
std::vector<double> smoothed(const std::vector<double>& differences, const std::vector<double>& time_s,
                             const HeadingNoise& noise) {
  const double density = noise.gyro_rad_s_sqrt_hz * noise.gyro_rad_s_sqrt_hz;
  const double r = noise.reference_rad * noise.reference_rad;
  const std::size_t n = differences.size();
  std::vector<double> x(n), variance(n), predicted(n);
  double at = 0.0, p = std::numeric_limits<double>::max();  // nothing is known at first
  for (std::size_t i = 0; i < n; ++i) {
    if (i > 0) p += density * (time_s[i] - time_s[i - 1]);
    predicted[i] = p;
    if (const double total = p + r; std::isfinite(differences[i]) && total > 0.0) {
      const double gain = p / total, largest = kLargestDeviation * std::sqrt(total);
      at += gain * std::clamp(differences[i] - at, -largest, largest);  // lost tracking counts as that much
      p *= 1.0 - gain;
      if (gain == 1.0) p = r;  // of what was not known at all
    }
    x[i] = at;
    variance[i] = p;
  }
  for (std::size_t i = n - 1; i-- > 0;)
    if (predicted[i + 1] > 0.0) x[i] += variance[i] / predicted[i + 1] * (x[i + 1] - x[i]);
  return x;
}

/// Of odometry that is turned, from epoch to epoch, by what its headings are off.
void add_positions(const FreeRun& free, const std::vector<double>& turned_rad, const Robot& robot, Drift& x,
                   Drift& y) {
  Pose2 body = free.body.front();
  for (std::size_t i = 0; i < free.body.size(); ++i) {
    if (i > 0) {
      body.heading = free.body[i - 1].heading + 0.5 * (turned_rad[i - 1] + turned_rad[i]);
      body = body * (free.body[i - 1].inverse() * free.body[i]);
    }
    if (!free.reference[i].has_position()) continue;
    const Pose2 sensor = body * robot.body_from_reference;
    x.add(free.path_m[i], free.reference[i].value.x() - sensor.x);
    y.add(free.path_m[i], free.reference[i].value.y() - sensor.y);
  }
  x.model_variance = free.variance.x();
  y.model_variance = free.variance.y();
}

/// One point of the variogram.
struct LagVariance {
  double lag_m = 0.0;
  double variance = 0.0;
  double stretches = 0.0;  ///< so many that do not overlap: what counts as independent evidence
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
    double lags = 0.0, path_m = 0.0;
    for (const Drift& e : drifts) {
      std::size_t j = 0;
      const std::size_t before = differences.size();
      for (std::size_t i = 0; i < e.path_m.size(); ++i) {
        while (j < e.path_m.size() && e.path_m[j] < e.path_m[i] + lag) ++j;
        if (j == e.path_m.size()) break;
        if (j == i) continue;
        differences.push_back(e.error[j] - e.error[i]);
        lags += e.path_m[j] - e.path_m[i];
      }
      if (differences.size() > before) path_m += e.path_m.back() - e.path_m.front();
    }
    if (differences.size() < kFewestPairs) continue;
    const double mean_lag = lags / static_cast<double>(differences.size());
    points.push_back({mean_lag, mean_square(differences), path_m / mean_lag});
  }
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

/// Calls `take` with each piece of each run.
template <class Take>
void for_each_piece(std::span<const Run> runs, const Take& take) {
  for (const Run& run : runs)
    if (!run.epochs.empty())
      for (const Piece& piece : pieces_of(run)) take(run, piece);
}

bool has_gyro_mostly(const Run& run) {
  const Increments& increments = run.readings.increments;
  std::size_t count = 0;
  for (std::size_t i = 0; i < increments.size(); ++i) count += increments[i].has_gyro ? 1 : 0;
  return 2 * count > increments.size();
}

}  // namespace

std::optional<Growth> growth_of_heading(std::span<const Run> runs, const Robot& robot) {
  std::vector<Drift> all;
  for_each_piece(runs, [&](const Run& run, const Piece& piece) {
    const FreeRun free = free_run(run, piece, robot);
    const std::vector<double> differences = heading_differences(free, robot);
    Drift& heading = all.emplace_back();
    heading.model_variance = free.variance.z();
    for (std::size_t i = 0; i < differences.size(); ++i)
      if (std::isfinite(differences[i])) heading.add(free.path_m[i], differences[i]);
  });
  return growth_of(all);
}

std::optional<Growth> growth_of_position(std::span<const Run> runs, const Robot& robot,
                                         const HeadingNoise& noise) {
  std::vector<Drift> all;
  for_each_piece(runs, [&](const Run& run, const Piece& piece) {
    const FreeRun free = free_run(run, piece, robot);
    Drift x, y;
    // Where the gyro is away what headings walk is the wheels', and only the start's error is taken out.
    const HeadingNoise walk = {has_gyro_mostly(run) ? noise.gyro_rad_s_sqrt_hz : 0.0, noise.reference_rad};
    add_positions(free, smoothed(heading_differences(free, robot), free.time_s, walk), robot, x, y);
    all.push_back(std::move(x));
    all.push_back(std::move(y));
  });
  return growth_of(all);
}

bool have_lags(std::span<const Run> runs) {
  return std::ranges::any_of(runs, [](const Run& run) { return run.epochs.size() >= kFewestEpochsForLags; });
}

}  // namespace trundle::calibration
