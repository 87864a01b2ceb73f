#include "trundle/odometry/gyro_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "trundle/geometry/squared.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::odometry {
namespace {

// A rest of more samples has at least two points of the Allan deviation, which fit_noise() needs.
constexpr std::size_t kFewestSamples = 10;
constexpr double kShortest_s = 1.0;  // of a rest, and of the pieces in which it is looked at

/// A gyro's samples while the robot rests, without a gap.
struct Rest {
  double start_s = 0.0, end_s = 0.0;
  std::vector<double> samples;

  double duration_s() const { return end_s - start_s; }
  double middle_s() const { return 0.5 * (start_s + end_s); }
  double mean() const {
    return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
  }
};

/// The samples in (start, end], split where one is missing: after a longer step.
void append_rests(const GyroStream& gyro, double start_s, double end_s, double longest_s,
                  std::vector<Rest>& rests) {
  const auto first = std::upper_bound(gyro.time_s.begin(), gyro.time_s.end(), start_s) - gyro.time_s.begin();
  std::vector<double> samples;
  double from_s = 0.0, to_s = 0.0;
  const auto close = [&] {
    if (samples.size() > kFewestSamples) rests.push_back({from_s, to_s, std::move(samples)});
    samples.clear();
  };
  for (auto row = static_cast<std::size_t>(first); row < gyro.time_s.size() && gyro.time_s[row] <= end_s;
       ++row) {
    const bool missing = std::isnan(gyro.yaw_rate_rad_s[row]);
    if (missing || (!samples.empty() && gyro.time_s[row] - to_s > longest_s)) close();
    if (missing) continue;
    if (samples.empty()) from_s = gyro.time_s[row];
    to_s = gyro.time_s[row];
    samples.push_back(gyro.yaw_rate_rad_s[row]);
  }
  close();
}

/// Whether nothing moved from the row before to this one.
bool rests_at(const Recording& recording, std::size_t row) {
  if (recording.wheels.time_s.empty())
    return recording.velocity.forward_m_s[row] == 0.0 && recording.velocity.yaw_rate_rad_s[row] == 0.0;
  return std::all_of(recording.wheels.series.begin(), recording.wheels.series.end(),
                     [&](const WheelSeries& series) {
                       return series.unit == WheelUnit::rate ? series.value[row] == 0.0
                                                             : series.value[row] == series.value[row - 1];
                     });
}

// A motion that lags behind a velocity ends with it by exp(−7), a thousandth.
constexpr double kLagsToStop = 7.0;

/// Rests of at least a second, without the moment of stopping and starting.
std::vector<Rest> rests_of(const Recording& recording, double gyro_later_s, double lag_s) {
  const double margin_s = 0.2 + kLagsToStop * lag_s;
  const auto& time_s = recording.wheels.time_s.empty() ? recording.velocity.time_s : recording.wheels.time_s;
  const double longest_s = longest_step(recording.gyro.time_s);
  std::vector<Rest> rests;
  if (time_s.empty())
    append_rests(recording.gyro, recording.gyro.time_s.front(), recording.gyro.time_s.back(), longest_s,
                 rests);
  for (std::size_t first = 0; first < time_s.size();) {
    std::size_t last = first;
    while (last + 1 < time_s.size() && rests_at(recording, last + 1)) ++last;
    if (time_s[last] - time_s[first] >= kShortest_s + 2.0 * margin_s)
      append_rests(recording.gyro, time_s[first] + margin_s - gyro_later_s,
                   time_s[last] - margin_s - gyro_later_s, longest_s, rests);
    first = last + 1;
  }
  return rests;
}

/// What readings are multiples of: the least step between two of them; 0: all are the same.
double resolution_of(const std::vector<Rest>& rests) {
  constexpr double kSinglePrecision = 1e-6;  // of the largest: rounding of what a log or a unit made of them
  std::vector<double> values;
  for (const Rest& rest : rests) values.insert(values.end(), rest.samples.begin(), rest.samples.end());
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  const double same = kSinglePrecision * std::max(std::abs(values.front()), std::abs(values.back()));
  double least = 0.0;
  for (std::size_t i = 1; i < values.size(); ++i)
    if (const double step = values[i] - values[i - 1]; step > same && (least == 0.0 || step < least))
      least = step;
  return least;
}

/// The most by which rounding to it adds to the variance of readings: where they toggle between two.
double rounded_variance(double resolution) {
  return 0.25 * resolution * resolution;
}

/// Of white noise, which a bias that walks hardly adds to: half the mean square of the steps.
double variance_of(std::span<const double> samples) {
  double squares = 0.0;
  for (std::size_t i = 1; i < samples.size(); ++i) squares += std::pow(samples[i] - samples[i - 1], 2);
  return squares / (2.0 * static_cast<double>(samples.size() - 1));
}

/// In pieces of so many samples or more.
std::vector<Rest> pieces_of(const Rest& rest, std::size_t fewest) {
  const std::size_t n = rest.samples.size(), count = std::max<std::size_t>(1, n / fewest);
  std::vector<Rest> pieces;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t first = i * n / count, end = (i + 1) * n / count;
    const auto time_s = [&](std::size_t sample) {
      return rest.start_s + rest.duration_s() * static_cast<double>(sample) / static_cast<double>(n - 1);
    };
    const auto samples = std::span(rest.samples).subspan(first, end - first);
    pieces.push_back({time_s(first), time_s(end - 1), {samples.begin(), samples.end()}});
  }
  return pieces;
}

/// Without the pieces in which the gyro scatters by far more than in most: there the robot was moved on
/// wheels that stood. A rest is cut where there is one.
std::vector<Rest> undisturbed(const std::vector<Rest>& rests, double step_s, double rounded) {
  constexpr double kMuchMore = 4.0;      // in variance: noise that is twice as large is another one
  constexpr double kNotByChance = 1e-3;  // that one of all pieces is cut out
  const auto fewest = std::max(kFewestSamples + 1, static_cast<std::size_t>(kShortest_s / step_s));
  std::vector<double> variances;
  for (const Rest& rest : rests)
    for (const Rest& piece : pieces_of(rest, fewest)) variances.push_back(variance_of(piece.samples));
  // Steps of n samples that are independent of each other have 2/3 n degrees of freedom.
  const double degrees = 2.0 / 3.0 * static_cast<double>(fewest);
  const double chance = kNotByChance / static_cast<double>(variances.size());
  const double most =
      std::max(kMuchMore, chi_squared_limit(chance, degrees) / degrees) * (median(variances) + rounded);
  std::vector<Rest> kept;
  for (const Rest& rest : rests) {
    bool goes_on = false;
    for (Rest& piece : pieces_of(rest, fewest)) {
      const bool is_quiet = variance_of(piece.samples) <= most;
      if (is_quiet && goes_on) {
        kept.back().end_s = piece.end_s;
        kept.back().samples.insert(kept.back().samples.end(), piece.samples.begin(), piece.samples.end());
      } else if (is_quiet) {
        kept.push_back(std::move(piece));
      }
      goes_on = is_quiet;
    }
  }
  return kept;
}

/// From one rest to the next the bias walks by K² Δt, on top of what white noise leaves in the means.
std::optional<double> walk_between(const std::vector<Rest>& rests, double variance) {
  constexpr std::size_t kFewestRests = 4;  // three steps, which tell their size within 1/√6 = 41 %, 1σ
  if (rests.size() < kFewestRests) return std::nullopt;
  double walk = 0.0, time_s = 0.0;
  for (std::size_t i = 1; i < rests.size(); ++i) {
    const double step = rests[i].mean() - rests[i - 1].mean();
    walk += step * step - variance / static_cast<double>(rests[i].samples.size()) -
            variance / static_cast<double>(rests[i - 1].samples.size());
    time_s += rests[i].middle_s() - rests[i - 1].middle_s();
  }
  return std::sqrt(std::max(0.0, walk) / time_s);
}

}  // namespace

double GyroNoise::degrees_of_freedom() const {
  return noise_sigma > 0.0 ? 0.5 * std::pow(noise_rad_s_sqrt_hz / noise_sigma, 2) : 0.0;
}

std::optional<GyroNoise> gyro_noise(const Recording& recording, double gyro_later_s, double lag_s) {
  if (recording.gyro.time_s.size() < 2) return std::nullopt;
  const double step_s = median_step(recording.gyro.time_s);
  std::vector<Rest> rests = rests_of(recording, gyro_later_s, lag_s);
  if (rests.empty()) return std::nullopt;
  const double rounded = rounded_variance(resolution_of(rests));
  rests = undisturbed(rests, step_s, rounded);
  std::vector<std::vector<double>> stretches;
  GyroNoise noise;
  noise.rounding_rad_s_sqrt_hz = std::sqrt(rounded * step_s);
  double samples = 0.0;
  for (const Rest& rest : rests) {
    noise.rest_s += rest.duration_s();
    noise.bias_rad_s += std::accumulate(rest.samples.begin(), rest.samples.end(), 0.0);
    samples += static_cast<double>(rest.samples.size());
    stretches.push_back(rest.samples);
  }
  noise.bias_rad_s /= samples;
  noise.allan = allan_deviation(stretches, step_s);
  const std::optional<NoiseFit> fit = fit_noise(noise.allan);
  if (!fit) return std::nullopt;
  noise.noise_rad_s_sqrt_hz = fit->density;
  noise.noise_sigma = fit->density_sigma;
  noise.bias_walk_rad_s_sqrt_s = fit->walk;
  noise.bias_walk_limit = fit->walk_limit;
  if (fit->walk) return noise;
  noise.bias_walk_rad_s_sqrt_s = walk_between(rests, fit->density * fit->density / step_s);
  noise.walk_between_rests = noise.bias_walk_rad_s_sqrt_s.has_value();
  return noise;
}

std::optional<GyroNoise> gyro_noise(const Recording& recording, const Chassis& chassis) {
  if (recording.wheels.time_s.empty() && recording.velocity.time_s.empty()) return std::nullopt;
  return gyro_noise(recording,
                    (chassis.gyro ? chassis.gyro->time_offset_s : 0.0) - chassis.wheels_time_offset_s,
                    chassis.velocity.lag_s);
}

bool is_louder(const GyroNoise& noise, double density) {
  constexpr double kChance = 1e-3;  // once in a thousand gyros that are as the file says
  const double degrees = noise.degrees_of_freedom();
  if (degrees <= 0.0) return false;
  const double variance = squared(density) + squared(noise.rounding_rad_s_sqrt_hz);
  return squared(noise.noise_rad_s_sqrt_hz) > variance * chi_squared_limit(kChance, degrees) / degrees;
}

GyroNoise pooled(std::span<const GyroNoise> all) {
  GyroNoise sum;
  double degrees = 0.0, variance = 0.0, rounded = 0.0;
  for (const GyroNoise& one : all) {
    const double own = one.degrees_of_freedom();
    degrees += own;
    variance += own * squared(one.noise_rad_s_sqrt_hz);
    rounded += own * squared(one.rounding_rad_s_sqrt_hz);
    sum.rest_s += one.rest_s;
  }
  if (degrees == 0.0) return sum;
  sum.noise_rad_s_sqrt_hz = std::sqrt(variance / degrees);
  sum.noise_sigma = sum.noise_rad_s_sqrt_hz / std::sqrt(2.0 * degrees);
  sum.rounding_rad_s_sqrt_hz = std::sqrt(rounded / degrees);
  return sum;
}

}  // namespace trundle::odometry
