#include "trundle/calibration/noise/growth.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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

/// How well a heading is known that a gyro carries on and that headings of the reference correct: a Kalman
/// filter of the heading alone, for a position that it corrected would not drift.
/// docs/theory/calibration-noise.md, eq. 8a.
class CarriedHeading {
 public:
  explicit CarriedHeading(const HeadingNoise& noise)
      : gyro_density_(noise.gyro_rad_s_sqrt_hz * noise.gyro_rad_s_sqrt_hz),
        reference_variance_(noise.reference_rad * noise.reference_rad),
        variance_(reference_variance_) {}

  void carry_on(double duration_s) { variance_ += gyro_density_ * duration_s; }
  /// By how much to turn it, of how much the reference's heading is further. Lost tracking counts as much as
  /// the largest error that is none.
  double correct(double difference) {
    const double total = variance_ + reference_variance_;
    if (total <= 0.0) return 0.0;
    const double gain = variance_ / total, largest = kLargestDeviation * std::sqrt(total);
    variance_ *= 1.0 - gain;
    return gain * std::clamp(difference, -largest, largest);
  }

 private:
  double gyro_density_;
  double reference_variance_;
  double variance_;
};

/// Free-running odometry against the reference; with `carried`, its headings are corrected by those.
Drifts drifts_of(const Run& run, const Piece& piece, const Robot& robot,
                 std::optional<CarriedHeading> carried = {}) {
  Drifts drifts;
  auto& [x, y, heading] = drifts;
  Pose2 body = body_at(run, piece.first, robot);
  Odometer odometer(robot, {.start = body});
  double path = 0.0;
  std::size_t done = run.epochs[piece.first];
  for (std::size_t epoch = piece.first; epoch < piece.end; ++epoch) {
    const Pose2 before = odometer.pose();
    for (; done < run.epochs[epoch]; ++done) {
      const Increment increment = run.readings.increments[done];
      odometer.step(increment);
      path += mean_travel(robot.chassis, increment);
    }
    body = body * (before.inverse() * odometer.pose());
    const ReferenceSample sample =
        sample_reference(run.reference, run.epoch_time(epoch) - robot.reference_time_offset_s);
    const Pose2 sensor = body * robot.body_from_reference;
    if (sample.has_position()) {
      x.add(path, sample.value.x() - sensor.x);
      y.add(path, sample.value.y() - sensor.y);
    }
    const bool is_start = epoch == piece.first;
    if (carried && !is_start) carried->carry_on(run.epoch_time(epoch) - run.epoch_time(epoch - 1));
    if (!sample.has_heading()) continue;
    const double difference = sample.value.z() - sensor.heading;
    if (carried && !is_start)
      body.heading += carried->correct(wrap_angle(difference));
    else if (!carried)
      heading.add(path, unwrap_angle(difference, heading.error.empty() ? 0.0 : heading.error.back()));
  }
  const Vector3 variance = odometer.white_covariance().diagonal();
  for (std::size_t i = 0; i < 3; ++i) drifts[i].model_variance = variance[static_cast<Eigen::Index>(i)];
  return drifts;
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

/// Calls `take` with each piece of each run.
template <class Take>
void for_each_piece(std::span<const Run> runs, const Take& take) {
  for (const Run& run : runs)
    if (!run.epochs.empty())
      for (const Piece& piece : pieces_of(run)) take(run, piece);
}

/// Whether the reference knows headings; elsewhere nothing corrects those of the gyro.
bool has_headings(const Run& run) {
  return std::ranges::any_of(run.reference.heading_rad, [](double h) { return std::isfinite(h); });
}

}  // namespace

std::optional<Growth> growth_of_heading(std::span<const Run> runs, const Robot& robot) {
  std::vector<Drift> all;
  for_each_piece(runs, [&](const Run& run, const Piece& piece) {
    all.push_back(std::move(drifts_of(run, piece, robot)[2]));
  });
  return growth_of(all);
}

std::optional<Growth> growth_of_position(std::span<const Run> runs, const Robot& robot,
                                         const HeadingNoise& noise) {
  std::vector<Drift> all;  // x and y of every piece
  for_each_piece(runs, [&](const Run& run, const Piece& piece) {
    const auto carried = has_headings(run) ? std::optional(CarriedHeading(noise)) : std::nullopt;
    Drifts drifts = drifts_of(run, piece, robot, carried);
    all.push_back(std::move(drifts[0]));
    all.push_back(std::move(drifts[1]));
  });
  return growth_of(all);
}

bool have_lags(std::span<const Run> runs) {
  return std::ranges::any_of(runs, [](const Run& run) { return run.epochs.size() >= kFewestEpochsForLags; });
}

}  // namespace trundle::calibration
