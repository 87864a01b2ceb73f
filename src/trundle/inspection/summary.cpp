#include <algorithm>
#include <cmath>

#include "trundle/inspection/inspect.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/csv/detail/table.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::inspection {
namespace {

/// Steps in a second, without gaps; 0: unknown. Not by their median: stamps in whole milliseconds hold 33 ms
/// for 30 Hz, and now and then 34.
double rate_hz_of(const std::vector<double>& time_s) {
  const double longest_s = longest_step(time_s);
  double duration_s = 0.0;
  std::size_t steps = 0;
  for (std::size_t row = 1; row < time_s.size(); ++row) {
    const double step_s = time_s[row] - time_s[row - 1];
    if (step_s > longest_s) continue;
    duration_s += step_s;
    ++steps;
  }
  return duration_s > 0.0 ? static_cast<double>(steps) / duration_s : 0.0;
}

void add(std::vector<StreamSummary>& summaries, StreamKind kind, const std::vector<double>& time_s,
         bool regular) {
  if (time_s.empty()) return;
  StreamSummary& summary = summaries.emplace_back();
  summary.stream = table_name_of(kind);
  summary.rows = time_s.size();
  summary.start_s = time_s.front();
  summary.end_s = time_s.back();
  if (regular) summary.rate_hz = rate_hz_of(time_s);
  const double longest_s = longest_step(time_s);
  for (std::size_t row = 1; row < time_s.size(); ++row) {
    const double step_s = time_s[row] - time_s[row - 1];
    summary.longest_step_s = std::max(summary.longest_step_s, step_s);
    summary.gaps += regular && step_s > longest_s ? 1 : 0;
  }
}

/// Degrees in one unit of a steering; nothing: counts of unknown size.
std::optional<double> degrees_per_unit(const WheelSeries& series, const Robot* robot) {
  if (series.unit == WheelUnit::radians) return degrees(1.0);
  for (std::size_t i = 0; robot != nullptr && i < robot->chassis.all_wheels().size(); ++i) {
    const auto& steering = robot->chassis.all_wheels()[i].steering;
    if (steering && steering->ticks_per_revolution != 0.0 && wheel_name(*robot, i) == series.wheel)
      return 360.0 / steering->ticks_per_revolution;
  }
  return std::nullopt;
}

/// No wheel moved from the row before to this one, as far as they were read.
bool stands_at(const WheelStream& wheels, std::size_t row) {
  return row > 0 && std::ranges::all_of(wheels.series, [row](const WheelSeries& series) {
           return series.unit == WheelUnit::rate ? series.value[row] == 0.0
                                                 : series.value[row] == series.value[row - 1];
         });
}

SteeringSummary summary_of(const WheelSeries& series, const WheelStream& wheels, const Robot* robot) {
  const std::optional<double> known = degrees_per_unit(series, robot);
  const double scale = known.value_or(1.0);
  SteeringSummary summary{.wheel = series.wheel, .in_ticks = !known};
  std::vector<double> time_s, reading, at_rest;
  for (std::size_t row = 0; row < series.value.size(); ++row) {
    if (std::isnan(series.value[row])) continue;
    time_s.push_back(wheels.time_s[row]);
    reading.push_back(scale * series.value[row]);
    if (stands_at(wheels, row)) at_rest.push_back(reading.back());
    if (reading.size() == 1) continue;
    const double step = reading.back() - reading[reading.size() - 2];
    const double step_s = time_s.back() - time_s[time_s.size() - 2];
    const double turned = std::abs(known ? std::remainder(step, 360.0) : step);
    if (step_s > 0.0) summary.fastest_per_s = std::max(summary.fastest_per_s, turned / step_s);
  }
  if (reading.empty()) return summary;
  const auto [least, greatest] = std::ranges::minmax(reading);
  summary.least = least;
  summary.greatest = greatest;
  summary.rate_hz = rate_hz_of(time_s);
  if (!at_rest.empty()) summary.at_rest = median(at_rest);
  return summary;
}

}  // namespace

std::vector<SteeringSummary> steerings_of(const Recording& recording, const Robot* robot) {
  std::vector<SteeringSummary> summaries;
  for (const WheelSeries& series : recording.wheels.steering)
    if (!std::ranges::all_of(series.value, [](double value) { return std::isnan(value); }))
      summaries.push_back(summary_of(series, recording.wheels, robot));
  return summaries;
}

std::vector<StreamSummary> summaries_of(const Recording& recording) {
  std::vector<StreamSummary> summaries;
  add(summaries, StreamKind::wheels, recording.wheels.time_s, true);
  if (!summaries.empty()) {
    for (const WheelSeries& series : recording.wheels.series)
      summaries.back().columns.push_back(column_name(series));
    for (const WheelSeries& series : recording.wheels.steering)
      summaries.back().columns.push_back(steering_column_name(series));
  }
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

}  // namespace trundle::inspection
