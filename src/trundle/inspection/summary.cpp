#include <algorithm>

#include "trundle/inspection/inspect.hpp"
#include "trundle/recording/csv/detail/streams.hpp"
#include "trundle/recording/csv/detail/table.hpp"

namespace trundle::inspection {
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

}  // namespace

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
