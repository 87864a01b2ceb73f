#include <algorithm>
#include <cmath>

#include "trundle/recording/detail/streams.hpp"
#include "trundle/recording/detail/table.hpp"
#include "trundle/recording/inspect.hpp"

namespace trundle {
namespace {

void add(std::vector<StreamSummary>& summaries, StreamKind kind, const std::vector<double>& time_s,
         bool regular) {
  if (time_s.empty()) return;
  StreamSummary& summary = summaries.emplace_back();
  summary.stream = table_name_of(kind);
  summary.rows = time_s.size();
  summary.start_s = time_s.front();
  summary.end_s = time_s.back();
  const double median_s = median_step(time_s);
  if (regular && median_s > 0.0) summary.rate_hz = 1.0 / median_s;
  const double longest_s = longest_step(time_s);
  for (std::size_t row = 1; row < time_s.size(); ++row) {
    const double step_s = time_s[row] - time_s[row - 1];
    summary.longest_step_s = std::max(summary.longest_step_s, step_s);
    summary.gaps += regular && step_s > longest_s ? 1 : 0;
  }
}

/// A gyro's samples while the robot rests.
struct Rest {
  double middle_s = 0.0;
  double duration_s = 0.0;
  std::size_t samples = 0;
  double mean = 0.0;
  double square_sum = 0.0;  ///< of deviations from the mean
};

Rest rest_between(const GyroStream& gyro, double start_s, double end_s) {
  Rest rest{(start_s + end_s) / 2.0, end_s - start_s};
  for (std::size_t row = 0; row < gyro.time_s.size(); ++row) {
    if (gyro.time_s[row] <= start_s || gyro.time_s[row] > end_s || std::isnan(gyro.yaw_rate_rad_s[row]))
      continue;
    const double deviation = gyro.yaw_rate_rad_s[row] - rest.mean;
    rest.mean += deviation / static_cast<double>(++rest.samples);
    rest.square_sum += deviation * (gyro.yaw_rate_rad_s[row] - rest.mean);
  }
  return rest;
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
  std::vector<Rest> rests;
  for (std::size_t first = 0; first < time_s.size();) {
    std::size_t last = first;
    while (last + 1 < time_s.size() && rests_at(recording, last + 1)) ++last;
    if (time_s[last] - time_s[first] >= kShortest + 2.0 * kMargin) {
      const Rest rest = rest_between(recording.gyro, time_s[first] + kMargin, time_s[last] - kMargin);
      if (rest.samples > 10) rests.push_back(rest);
    }
    first = last + 1;
  }
  return rests;
}

}  // namespace

std::vector<StreamSummary> summaries_of(const Recording& recording) {
  std::vector<StreamSummary> summaries;
  add(summaries, StreamKind::wheels, recording.wheels.time_s, true);
  if (!summaries.empty())
    for (const WheelSeries& series : recording.wheels.series)
      summaries.back().columns.push_back(column_name(series));
  add(summaries, StreamKind::gyro, recording.gyro.time_s, true);
  add(summaries, StreamKind::velocity, recording.velocity.time_s, true);
  add(summaries, StreamKind::commands, recording.commands.time_s, true);
  add(summaries, StreamKind::accel, recording.accel.time_s, true);
  std::vector<double> stamps;
  for (const Sighting& sighting : recording.sightings) stamps.push_back(sighting.time_s);
  add(summaries, StreamKind::sightings, stamps, false);
  add(summaries, StreamKind::reference, recording.reference.time_s, true);
  stamps.clear();
  for (const RelativeMotion& motion : recording.relative_motions) stamps.push_back(motion.start_s);
  add(summaries, StreamKind::relative_motion, stamps, false);
  return summaries;
}

std::optional<GyroNoise> gyro_noise(const Recording& recording) {
  if (recording.gyro.time_s.size() < 2) return std::nullopt;
  const std::vector<Rest> rests = rests_of(recording);
  if (rests.empty()) return std::nullopt;
  GyroNoise noise;
  double samples = 0.0, square_sum = 0.0, degrees_of_freedom = 0.0;
  for (const Rest& rest : rests) {
    const auto n = static_cast<double>(rest.samples);
    noise.rest_s += rest.duration_s;
    noise.bias_rad_s += n * rest.mean;
    samples += n;
    square_sum += rest.square_sum;
    degrees_of_freedom += n - 1.0;
  }
  noise.bias_rad_s /= samples;
  const double variance = square_sum / degrees_of_freedom;
  noise.noise_rad_s_sqrt_hz = std::sqrt(variance * median_step(recording.gyro.time_s));
  // From one rest to the next the bias walks by w² Δt, on top of what white noise leaves in the means.
  double walk = 0.0, time_s = 0.0;
  for (std::size_t i = 1; i < rests.size(); ++i) {
    const double step = rests[i].mean - rests[i - 1].mean;
    walk += step * step - variance / static_cast<double>(rests[i].samples) -
            variance / static_cast<double>(rests[i - 1].samples);
    time_s += rests[i].middle_s - rests[i - 1].middle_s;
  }
  constexpr std::size_t kFewestRests = 4;
  if (rests.size() >= kFewestRests) noise.bias_walk_rad_s_sqrt_s = std::sqrt(std::max(0.0, walk) / time_s);
  return noise;
}

}  // namespace trundle
