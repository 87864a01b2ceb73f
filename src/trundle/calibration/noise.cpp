#include "trundle/calibration/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "trundle/calibration/learn_noise.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle {
namespace {

constexpr double kSmallestWheelNoise = 1e-5;  // [m/√m]
constexpr double kSmallestHeadingNoise_rad = 1e-5;
constexpr double kSmallestPositionNoise_m = 1e-5;
constexpr std::size_t kFewestPairs = 20;
constexpr std::size_t kFewestKnotsForLags = 11;
// Differences larger than so many robust sigmas are lost tracking, not wobble: they count as that much.
constexpr double kLargestDeviation = 6.0;
constexpr double kLargestCorrelation = 0.95;
constexpr double kSigmaOfMedian = 1.4826;    // from the median of |x| to the σ of a Gaussian
constexpr double kLargestInnovation = 30.0;  // the same for squared Mahalanobis innovations

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

/// Reference minus free-running odometry, of one quantity along one run.
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

Drifts drifts_from(const Pose2& start, const Run& run, const Robot& robot) {
  Drifts drifts;
  auto& [x, y, heading] = drifts;
  Odometer odometer(robot, {.start = start});
  double path = 0.0;
  std::size_t done = run.knots.front();
  for (std::size_t knot = 0; knot < run.knots.size(); ++knot) {
    for (; done < run.knots[knot]; ++done) {
      odometer.step(run.readings.increments[done]);
      path += mean_travel(robot.chassis, run.readings.increments[done]);
    }
    const ReferenceSample sample =
        sample_reference(run.reference, run.knot_time(knot) - robot.reference_time_offset_s);
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

/// An error of the start heading swings the whole run, and would pass for noise that grows: the mean of all
/// headings shows it better than the first of them.
Drifts drifts_of(const Run& run, const Robot& robot) {
  Pose2 start = body_at_start(run, robot);
  Drifts drifts = drifts_from(start, run, robot);
  const std::vector<double>& error = drifts[2].error;
  if (!robot.chassis.gyro || error.empty()) return drifts;
  start.heading += std::accumulate(error.begin(), error.end(), 0.0) / static_cast<double>(error.size());
  return drifts_from(start, run, robot);
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

/// Mean squared innovation per scalar, outliers cut; 1 is consistent.
double innovation_size(std::span<const Run> runs, const Robot& robot, const ReferenceNoise& noise) {
  double sum = 0.0;
  int count = 0;
  for (const Run& run : runs) {
    for (const Innovation& innovation :
         stream_likelihood(run, robot, {}, {.reference_noise = noise}).innovations) {
      sum += std::min(innovation.squared_mahalanobis, kLargestInnovation);
      count += innovation.count;
    }
  }
  return count == 0 ? 1.0 : sum / count;
}

/// The position noise that makes the innovations as large as expected: bisection on its logarithm.
double consistent_position_noise(std::span<const Run> runs, const Robot& robot, ReferenceNoise noise) {
  double low = std::log(kSmallestPositionNoise_m);
  double high = std::log(1.0);
  for (int i = 0; i < 20; ++i) {
    const double middle = 0.5 * (low + high);
    noise.position_m = std::exp(middle);
    (innovation_size(runs, robot, noise) > 1.0 ? low : high) = middle;
  }
  return std::exp(high);
}

/// Correlation of each normalised innovation with the one before it; 0 where it may be chance.
Vector3 autocorrelation(std::span<const Run> runs, const Robot& robot, const ReferenceNoise& noise) {
  Vector3 lagged = Vector3::Zero();
  Vector3 own = Vector3::Zero();
  double count = 0.0;
  const auto cut = [](const Innovation& i) { return i.normalised.cwiseMax(-3.0).cwiseMin(3.0).eval(); };
  for (const Run& run : runs) {
    const auto innovations = stream_likelihood(run, robot, {}, {.reference_noise = noise}).innovations;
    for (std::size_t i = 1; i < innovations.size(); ++i) {
      lagged += cut(innovations[i - 1]).cwiseProduct(cut(innovations[i]));
      own += cut(innovations[i]).cwiseAbs2();
      count += 1.0;
    }
  }
  const Vector3 rho = lagged.cwiseQuotient(own.cwiseMax(1e-12)).cwiseMin(kLargestCorrelation);
  const double chance = 3.0 / std::sqrt(std::max(count, 1.0));  // three sigma
  return (rho.array() > chance).select(rho, 0.0);
}

/// Errors that persist over several knots teach less than their number suggests: a mean of n values with
/// correlation ρ from one to the next has the variance of n (1 − ρ)/(1 + ρ) independent ones.
void allow_for_correlation(std::span<const Run> runs, const Robot& robot, ReferenceNoise& noise) {
  const Vector3 rho = autocorrelation(runs, robot, noise);
  const double position = 0.5 * (rho.x() + rho.y());
  noise.position_persistence = std::sqrt((1.0 + position) / (1.0 - position));
  noise.heading_persistence = std::sqrt((1.0 + rho.z()) / (1.0 - rho.z()));
}

/// How the differences of reference and odometry grow along the runs.
struct Growth {
  double odometry = 1.0;         ///< σ of what grows, over the model's
  double reference_sigma = 0.0;  ///< of what is alike at all lags
};

/// Nothing when the runs are too short or too few. docs/theory/calibration-noise.md, eq. 8.
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
  std::vector<Drift> position;  ///< x and y of every run
  std::vector<Drift> heading;
};

RunDrifts drifts_of(std::span<const Run> runs, const Robot& robot) {
  RunDrifts all;
  for (const Run& run : runs) {
    if (run.knots.empty()) continue;
    Drifts drifts = drifts_of(run, robot);
    all.position.push_back(std::move(drifts[0]));
    all.position.push_back(std::move(drifts[1]));
    all.heading.push_back(std::move(drifts[2]));
  }
  return all;
}

/// The robot as if its gyro were perfect: what then grows in its position is the wheels'.
Robot with_perfect_gyro(Robot robot) {
  robot.chassis.gyro->noise_rad_s_sqrt_hz = 0.0;
  robot.chassis.gyro->bias_walk_rad_s_sqrt_s = 0.0;
  return robot;
}

/// Whether the runs are so long against the spacing of their knots that lags differ.
bool have_lags(std::span<const Run> runs) {
  return std::ranges::any_of(runs, [](const Run& run) { return run.knots.size() >= kFewestKnotsForLags; });
}

/// Where a gyro tells the heading, the wheels' noise shows in the position, and the heading shows the gyro's.
void learn_noise_with_gyro(std::span<const Run> runs, const Robot& robot, NoiseEstimate& noise) {
  if (!have_lags(runs)) return;
  if (const auto growth = growth_of(drifts_of(runs, with_noise(with_perfect_gyro(robot), noise)).position)) {
    noise.wheel_per_sqrt_m = std::max(noise.wheel_per_sqrt_m * growth->odometry, kSmallestWheelNoise);
    noise.from_runs = true;
  }
  if (const auto growth = growth_of(drifts_of(runs, with_noise(robot, noise)).heading)) {
    noise.reference.heading_rad = std::max(growth->reference_sigma, kSmallestHeadingNoise_rad);
    noise.gyro_factor = std::max(growth->odometry, 1.0);
  }
}

void learn_noise_of_wheels(std::span<const Run> runs, const Robot& robot, NoiseEstimate& noise) {
  const auto growth = growth_of(drifts_of(runs, with_noise(robot, noise)).heading);
  if (!growth) return;
  noise.wheel_per_sqrt_m = std::max(noise.wheel_per_sqrt_m * growth->odometry, kSmallestWheelNoise);
  noise.reference.heading_rad = std::max(growth->reference_sigma, kSmallestHeadingNoise_rad);
  noise.from_runs = true;
}

/// Runs too short for lags: what odometry misses of them as a whole.
bool learn_noise_of_pieces(std::span<const Run> runs, const Robot& robot, NoiseEstimate& noise) {
  const auto learned = learn_noise_if_possible(runs, robot, {.per_wheel = false});
  if (!learned) return false;
  noise.wheel_per_sqrt_m = learned->noise.wheel_per_sqrt_m;
  noise.sideways = learned->noise;
  noise.reference.position_m = std::max(learned->reference_position_m, kSmallestPositionNoise_m);
  noise.reference.heading_rad = std::max(learned->reference_heading_rad, kSmallestHeadingNoise_rad);
  if (learned->gyro_rad_s_sqrt_hz)
    noise.gyro_factor =
        *learned->gyro_rad_s_sqrt_hz / std::max(robot.chassis.gyro->noise_rad_s_sqrt_hz, 1e-12);
  noise.from_runs = true;
  return true;
}

}  // namespace

NoiseEstimate estimate_noise(std::span<const Run> runs, const Robot& robot) {
  NoiseEstimate noise{typical_wheel_noise(robot.chassis), {}, false};
  if (robot.chassis.gyro) {
    learn_noise_with_gyro(runs, robot, noise);
  } else {
    learn_noise_of_wheels(runs, robot, noise);
  }
  if (!noise.from_runs && learn_noise_of_pieces(runs, robot, noise)) return noise;
  noise.reference.position_m = consistent_position_noise(runs, with_noise(robot, noise), noise.reference);
  allow_for_correlation(runs, with_noise(robot, noise), noise.reference);
  return noise;
}

Robot with_noise(const Robot& robot, const NoiseEstimate& noise) {
  Robot result = robot;
  if (noise.sideways) result.chassis.noise = *noise.sideways;
  set_typical_wheel_noise(noise.wheel_per_sqrt_m, result.chassis);
  if (result.chassis.gyro) result.chassis.gyro->noise_rad_s_sqrt_hz *= noise.gyro_factor;
  for (Wheel& wheel : result.chassis.wheels()) wheel.ticks_per_revolution = 0.0;
  return result;
}

// The variance of a reading grows with the travel, and so once with the diameter; here it must grow twice.
Robot with_noise_of_readings(const Robot& robot, const Chassis& nominal) {
  Robot result = robot;
  const auto wheels = result.chassis.wheels();
  for (std::size_t i = 0; i < wheels.size(); ++i)
    wheels[i].noise_per_sqrt_m = wheel_noise(robot.chassis, i) *
                                 std::sqrt(std::abs(wheels[i].diameter_m / nominal.wheels()[i].diameter_m));
  return result;
}

}  // namespace trundle
