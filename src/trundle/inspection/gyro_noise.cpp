#include "trundle/inspection/gyro_noise.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "trundle/recording/csv/detail/table.hpp"

namespace trundle::inspection {
namespace {

/// A gyro's samples while the robot rests, without a gap.
struct Rest {
  double middle_s = 0.0;
  double duration_s = 0.0;
  std::vector<double> samples;

  double mean() const {
    return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
  }
};

/// The samples in (start, end], split where one is missing: after a longer step.
void append_rests(const GyroStream& gyro, double start_s, double end_s, double longest_s,
                  std::vector<Rest>& rests) {
  // A rest of more has at least two points of the Allan deviation, which fit_noise() needs.
  constexpr std::size_t kFewestSamples = 10;
  const auto first = std::upper_bound(gyro.time_s.begin(), gyro.time_s.end(), start_s) - gyro.time_s.begin();
  std::vector<double> samples;
  double from_s = 0.0, to_s = 0.0;
  const auto close = [&] {
    if (samples.size() > kFewestSamples)
      rests.push_back({(from_s + to_s) / 2.0, to_s - from_s, std::move(samples)});
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

/// Rests of at least a second, without the moment of stopping and starting.
std::vector<Rest> rests_of(const Recording& recording) {
  constexpr double kShortest = 1.0;  // [s]
  constexpr double kMargin = 0.2;    // [s]
  const auto& time_s = recording.wheels.time_s.empty() ? recording.velocity.time_s : recording.wheels.time_s;
  const double longest_s = longest_step(recording.gyro.time_s);
  std::vector<Rest> rests;
  if (time_s.empty())
    append_rests(recording.gyro, recording.gyro.time_s.front(), recording.gyro.time_s.back(), longest_s,
                 rests);
  for (std::size_t first = 0; first < time_s.size();) {
    std::size_t last = first;
    while (last + 1 < time_s.size() && rests_at(recording, last + 1)) ++last;
    if (time_s[last] - time_s[first] >= kShortest + 2.0 * kMargin)
      append_rests(recording.gyro, time_s[first] + kMargin, time_s[last] - kMargin, longest_s, rests);
    first = last + 1;
  }
  return rests;
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
    time_s += rests[i].middle_s - rests[i - 1].middle_s;
  }
  return std::sqrt(std::max(0.0, walk) / time_s);
}

}  // namespace

std::optional<GyroNoise> gyro_noise(const Recording& recording) {
  if (recording.gyro.time_s.size() < 2) return std::nullopt;
  const std::vector<Rest> rests = rests_of(recording);
  const double step_s = median_step(recording.gyro.time_s);
  std::vector<std::vector<double>> stretches;
  GyroNoise noise;
  double samples = 0.0;
  for (const Rest& rest : rests) {
    noise.rest_s += rest.duration_s;
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

}  // namespace trundle::inspection
