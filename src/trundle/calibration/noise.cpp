#include "trundle/calibration/noise.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/odometry/odometer.hpp"

namespace trundle {
namespace {

constexpr double kSmallestWheelNoise = 1e-5;  // [m/√m]
constexpr double kLargestWheelNoise = 0.3;
constexpr double kSmallestHeadingNoise_rad = 1e-5;
constexpr double kSmallestPositionNoise_m = 1e-5;
constexpr std::size_t kFewestPairs = 20;
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

/// Heading of the reference minus that of free-running odometry, along one run.
struct HeadingError {
  std::vector<double> path_m;
  std::vector<double> error_rad;
  double model_variance = 0.0;  ///< of odometry's heading at the end for the wheel noise it was run with
};

HeadingError heading_error(const Run& run, const Robot& robot) {
  HeadingError result;
  Odometer odometer(robot, {});
  double path = 0.0;
  std::size_t done = run.knots.front();
  for (std::size_t knot = 0; knot < run.knots.size(); ++knot) {
    for (; done < run.knots[knot]; ++done) {
      const Increment& increment = run.readings.increments[done];
      odometer.step(increment);
      for (std::size_t w = 0; w < robot.chassis.wheels().size(); ++w)
        path += std::abs(kPi * robot.chassis.wheels()[w].diameter_m * increment.turned[w]) /
                robot.chassis.wheel_count;
    }
    const ReferenceSample sample =
        sample_reference(run.reference, run.knot_time(knot) - robot.reference_time_offset_s);
    if (!sample.has_heading()) continue;
    const double previous = result.error_rad.empty() ? 0.0 : result.error_rad.back();
    result.path_m.push_back(path);
    result.error_rad.push_back(unwrap_angle(sample.value.z() - odometer.pose().heading, previous));
  }
  result.model_variance = odometer.white_covariance()(2, 2);
  return result;
}

/// One point of the variogram.
struct LagVariance {
  double lag_m = 0.0;
  double variance = 0.0;
  double weight = 0.0;
};

std::vector<LagVariance> variogram(std::span<const HeadingError> errors) {
  double longest = 0.0;
  for (const HeadingError& e : errors)
    if (!e.path_m.empty()) longest = std::max(longest, e.path_m.back() - e.path_m.front());
  std::vector<LagVariance> points;
  // Longer lags are no use: the fitted parameters have already bent the odometry to the reference over them.
  for (const double share : {1.0 / 64, 1.0 / 32, 1.0 / 16, 3.0 / 32, 1.0 / 8, 3.0 / 16}) {
    const double lag = share * longest;
    std::vector<double> differences;
    double lags = 0.0;
    for (const HeadingError& e : errors) {
      std::size_t j = 0;
      for (std::size_t i = 0; i < e.path_m.size(); ++i) {
        while (j < e.path_m.size() && e.path_m[j] < e.path_m[i] + lag) ++j;
        if (j == e.path_m.size()) break;
        if (j == i) continue;
        differences.push_back(e.error_rad[j] - e.error_rad[i]);
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

/// −2 log likelihood of the innovations, outliers cut. docs/calibration.md, eq. 9.
double surprise(std::span<const Run> runs, const Robot& robot, const ReferenceNoise& noise) {
  double sum = 0.0;
  for (const Run& run : runs)
    for (const Innovation& innovation :
         stream_likelihood(run, robot, {}, {.reference_noise = noise}).innovations)
      sum += std::min(innovation.squared_mahalanobis, kLargestInnovation) + innovation.log_determinant;
  return sum;
}

/// Where a function of log x is smallest between two bounds: golden section.
template <class Function>
double smallest(double low, double high, const Function& function) {
  constexpr double kGolden = 0.6180339887498949;
  double a = std::log(low);
  double b = std::log(high);
  double left = b - kGolden * (b - a);
  double right = a + kGolden * (b - a);
  double at_left = function(std::exp(left));
  double at_right = function(std::exp(right));
  while (b - a > 0.02) {
    if (at_left < at_right) {
      b = right;
      right = left;
      at_right = at_left;
      left = b - kGolden * (b - a);
      at_left = function(std::exp(left));
    } else {
      a = left;
      left = right;
      at_left = at_right;
      right = a + kGolden * (b - a);
      at_right = function(std::exp(right));
    }
  }
  return std::exp(0.5 * (a + b));
}

/// Wheel noise and position noise that make the innovations most likely, in turn.
void most_likely_noise(std::span<const Run> runs, const Robot& robot, NoiseEstimate& noise) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    const Robot noisy = with_noise(robot, noise);
    noise.reference.position_m = smallest(kSmallestPositionNoise_m, 1.0, [&](double position_m) {
      ReferenceNoise reference = noise.reference;
      reference.position_m = position_m;
      return surprise(runs, noisy, reference);
    });
    noise.wheel_per_sqrt_m = smallest(kSmallestWheelNoise, kLargestWheelNoise, [&](double wheel_per_sqrt_m) {
      NoiseEstimate candidate = noise;
      candidate.wheel_per_sqrt_m = wheel_per_sqrt_m;
      return surprise(runs, with_noise(robot, candidate), noise.reference);
    });
  }
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

/// By how much odometry's heading error grows faster than the model says.
double growth_factor(std::span<const HeadingError> errors, const Line& line) {
  double model = 0.0;
  double path = 0.0;
  for (const HeadingError& e : errors) {
    model += e.model_variance;
    if (!e.path_m.empty()) path += e.path_m.back();
  }
  return std::sqrt(line.slope * path / std::max(model, 1e-30));
}

}  // namespace

NoiseEstimate estimate_noise(std::span<const Run> runs, const Robot& robot) {
  NoiseEstimate noise{robot.chassis.noise.wheel_per_sqrt_m, {}, false};
  const Robot unrounded = with_noise(robot, noise);
  std::vector<HeadingError> errors;
  for (const Run& run : runs)
    if (!run.knots.empty()) errors.push_back(heading_error(run, unrounded));
  const std::vector<LagVariance> points = variogram(errors);
  const bool by_gyro = robot.chassis.gyro.has_value();
  if (points.size() >= 3) {
    const Line line = fit_line(points);
    const double growth = growth_factor(errors, line);
    noise.reference.heading_rad = std::max(std::sqrt(0.5 * line.intercept), kSmallestHeadingNoise_rad);
    noise.from_runs = true;
    if (by_gyro) {
      noise.gyro_factor = std::max(growth, 1.0);
      most_likely_noise(runs, robot, noise);
    } else {
      noise.wheel_per_sqrt_m = std::max(noise.wheel_per_sqrt_m * growth, kSmallestWheelNoise);
    }
  }
  if (!by_gyro || !noise.from_runs)
    noise.reference.position_m = consistent_position_noise(runs, with_noise(robot, noise), noise.reference);
  allow_for_correlation(runs, with_noise(robot, noise), noise.reference);
  return noise;
}

Robot with_noise(const Robot& robot, const NoiseEstimate& noise) {
  Robot result = robot;
  result.chassis.noise.wheel_per_sqrt_m = noise.wheel_per_sqrt_m;
  if (result.chassis.gyro) result.chassis.gyro->noise_rad_s_sqrt_hz *= noise.gyro_factor;
  for (Wheel& wheel : result.chassis.wheels()) wheel.ticks_per_revolution = 0.0;
  return result;
}

}  // namespace trundle
