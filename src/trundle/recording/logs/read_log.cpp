#include <algorithm>
#include <cmath>
#include <deque>
#include <variant>

#include <fmt/format.h>

#include "trundle/recording/csv/detail/cells.hpp"
#include "trundle/recording/logs/detail/held_values.hpp"
#include "trundle/recording/logs/detail/log_stream.hpp"
#include "trundle/recording/logs/detail/transforms.hpp"
#include "trundle/statistics/nth_smallest.hpp"

namespace trundle::recording {
namespace {

using logs::Message;

/// A stream of one log, of either kind.
using AnyStream = std::variant<LogStream, TransformStream>;

AnyStream stream_of(const StreamSource& source, const logs::Definitions& definitions) {
  if (!source.transforms.empty()) return AnyStream(std::in_place_type<TransformStream>, source);
  return AnyStream(std::in_place_type<LogStream>, source, definitions);
}

void take_message(AnyStream& stream, const Message& message) {
  std::visit([&](auto& one) { one.take(message); }, stream);
}

}  // namespace

Finding finding_of_stamps(const std::vector<std::int64_t>& stamps, const std::vector<std::int64_t>& log_times,
                          const std::string& place) {
  const auto delay = [&](std::size_t i) { return static_cast<double>(log_times[i] - stamps[i]); };
  const std::size_t count = stamps.size();
  const double median = logs::kNanosecond_s * nth_smallest(count, (count - 1) / 2, delay);
  double farthest = 0.0;
  for (std::size_t i = 0; i < count; ++i)
    farthest = std::max(farthest, std::abs(logs::kNanosecond_s * delay(i) - median));
  constexpr double kDay_s = 86'400.0;  // no message travels so long
  if (std::abs(median) > kDay_s)
    return {Severity::note, FindingCode::log_stamps, place, count, {}, payload::Amount{farthest}};
  return {Severity::note, FindingCode::log_stamps, place, count, {}, payload::Range{median, farthest}};
}

std::optional<double> first_stamp_of_log(const StreamSource& source, const logs::Definitions& definitions) {
  const auto log = logs::open_log(source.file);
  AnyStream stream = stream_of(source, definitions);
  while (const std::optional<Message> message = log->next()) {
    take_message(stream, *message);
    if (const auto stamp = std::visit([](const auto& one) { return one.first_stamp(); }, stream))
      return seconds_of(*stamp, 0);
  }
  return std::nullopt;
}

std::vector<Table> read_log(std::span<const LogStreamSource> sources, const logs::Definitions& definitions,
                            std::vector<Finding>& findings) {
  const auto log = logs::open_log(sources.front().source->file);
  std::deque<AnyStream> streams;
  for (const LogStreamSource& stream : sources) streams.push_back(stream_of(*stream.source, definitions));
  while (const std::optional<Message> message = log->next())
    for (AnyStream& stream : streams) take_message(stream, *message);
  const auto is_same = [](const Finding& a, const Finding& b) {
    return a.code == b.code && a.place == b.place;
  };
  if (const std::optional<logs::Cut>& cut = log->cut())
    findings.push_back({Severity::warning,
                        FindingCode::log_cut,
                        cut->byte == 0 ? cut->place : fmt::format("{}, byte {}", cut->place, cut->byte),
                        1,
                        {},
                        payload::Names{{cut->reason}}});
  if (const std::span<const logs::Loss> losses = log->losses(); !losses.empty()) {
    double bytes = 0.0;
    for (const logs::Loss& loss : losses) bytes += static_cast<double>(loss.bytes);
    findings.push_back(
        {Severity::warning,
         FindingCode::log_loss,
         fmt::format("{}, byte {}", sources.front().source->file.string(), losses.front().byte),
         losses.size(),
         {},
         payload::Amount{bytes}});
  }
  std::vector<Table> tables;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    std::vector<Finding> of_stream;
    Table table = std::visit([&](auto& stream) { return stream.finish(of_stream); }, streams[i]);
    if (log->is_written_on_change())
      hold_between_changes(sources[i].kind, *sources[i].source, table, of_stream);
    tables.push_back(std::move(table));
    for (const Finding& finding : of_stream)  // two streams of one topic have the same
      if (std::ranges::none_of(findings, [&](const Finding& other) { return is_same(finding, other); }))
        findings.push_back(finding);
  }
  return tables;
}

}  // namespace trundle::recording
