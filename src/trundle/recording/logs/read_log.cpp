#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <memory>
#include <variant>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/field_reader.hpp"
#include "trundle/recording/csv/detail/cells.hpp"
#include "trundle/recording/csv/detail/quaternion.hpp"
#include "trundle/recording/logs/detail/held_values.hpp"
#include "trundle/recording/logs/detail/log_streams.hpp"
#include "trundle/recording/logs/detail/transforms.hpp"
#include "trundle/recording/logs/detail/up_axis.hpp"
#include "trundle/statistics/nth_smallest.hpp"

namespace trundle::recording {
namespace {

using logs::Channel;
using logs::FieldReader;
using logs::Layout;
using logs::Message;

constexpr std::string_view kUp = ".up";    ///< of three axes, the one that points up
constexpr std::string_view kYaw = ".yaw";  ///< of a quaternion

/// What is read of the messages of one channel.
struct ChannelReaders {
  std::optional<FieldReader> stamp;   ///< none: the log's time
  std::optional<FieldReader> status;  ///< of a sensor_msgs/NavSatFix: below 0 it has no fix
  std::vector<std::pair<std::size_t, FieldReader>> columns;  ///< of LogStream::values_
  bool makes_rows = false;
  UpAxis* up = nullptr;
};

/// The nanoseconds of a stamp that is a number in the stream's unit.
std::optional<std::int64_t> nanoseconds_of(const logs::Value& value, bool is_time, int unit_exponent) {
  constexpr auto kMost = static_cast<double>(logs::kLatestTime_ns);
  const auto* const whole = std::get_if<std::int64_t>(&value);
  if (is_time) return whole == nullptr ? std::nullopt : std::optional(*whole);
  const std::optional<double> number = logs::number_of(value);
  if (!number) return std::nullopt;
  double factor = 1.0;
  for (int exponent = unit_exponent; exponent > -9; --exponent) factor *= 10.0;
  const double nanoseconds = *number * factor;
  if (!(std::abs(nanoseconds) < kMost)) return std::nullopt;
  if (whole != nullptr) return *whole * static_cast<std::int64_t>(factor);
  if (const auto* const count = std::get_if<std::uint64_t>(&value))
    return static_cast<std::int64_t>(*count * static_cast<std::uint64_t>(factor));
  return static_cast<std::int64_t>(std::round(nanoseconds));
}

/// One stream's rows, as the messages come.
class LogStream {
 public:
  LogStream(const StreamSource& source, const logs::Definitions& definitions)
      : source_(source), definitions_(definitions) {
    for (const ColumnSource& column : source.columns) {
      first_value_.push_back(paths_.size());
      if (column.name.empty()) continue;  // the stream may have it, the log does not
      if (column.name.ends_with(kUp))
        add_parts(column, kUp, {".x", ".y", ".z"});
      else if (column.name.ends_with(kYaw))
        add_parts(column, kYaw, {".x", ".y", ".z", ".w"});
      else
        paths_.push_back({column.name, &column});
      holds_ = holds_ || topic_of(column) != source.topic;
    }
    numbers_.resize(paths_.size());
    texts_.resize(paths_.size());
    held_.resize(paths_.size());
  }

  void take(const Message& message) {
    ChannelReaders* const readers = readers_of(message);
    if (readers == nullptr) return;
    ++messages_;
    if (readers->status && logs::number_of(readers->status->read(message)).value_or(-1.0) < 0.0) return;
    if (readers->up != nullptr) readers->up->add(message);
    if (holds_)
      take_held(message, *readers);
    else
      take_rows(message, *readers);
  }

  /// Nothing: no row is there yet.
  std::optional<std::int64_t> first_stamp() const {
    if (stamps_.empty()) return std::nullopt;
    const bool has_none = is_header_stamp_ && stamps_.front() == 0;
    return has_none ? log_times_.front() : stamps_.front();
  }

  Table finish(std::vector<Finding>& findings) {
    if (pending_) push_held();
    if (stamps_.empty()) refuse_empty();
    Table table;
    const std::string name = place_name();
    table.origin.file = name;
    table.origin.lines = std::move(ordinals_);
    table.origin.time_offset_s = source_.time_offset_s;
    report_stamps(findings, name);
    for (const std::int64_t stamp : stamps_)
      table.time_s.push_back(seconds_of(stamp, source_.time_scale.origin_s) + source_.time_offset_s);
    for (std::size_t i = 0; i < source_.columns.size(); ++i) take_column(i, table, findings, name);
    return table;
  }

 private:
  /// Of a value that is computed of several fields.
  void add_parts(const ColumnSource& column, std::string_view ending,
                 std::initializer_list<std::string_view> parts) {
    const std::string stem = column.name.substr(0, column.name.size() - ending.size());
    for (const std::string_view part : parts) paths_.push_back({stem + std::string(part), &column});
  }

  struct PendingRow {
    std::int64_t stamp;
    std::int64_t log_time;
    std::int64_t start;  ///< of its instant
  };

  struct Path {
    std::string path;
    const ColumnSource* column;
  };

  const std::string& topic_of(const ColumnSource& column) const {
    return column.topic.empty() ? source_.topic : column.topic;
  }

  std::string place_name() const {
    const std::string& topic = source_.topic.empty() ? source_.columns.front().topic : source_.topic;
    return fmt::format("{} {}", source_.file.string(), topic);
  }

  const std::string& place_of(const ColumnSource& column) const {
    return column.place.empty() ? source_.place : column.place;
  }

  /// Compiled when a channel is met first; nullptr: nothing of it is wanted.
  ChannelReaders* readers_of(const Message& message) {
    const Channel& channel = *message.channel;
    if (const auto found = readers_.find(&channel); found != readers_.end()) return found->second.get();
    std::unique_ptr<ChannelReaders>& readers = readers_[&channel];
    const bool is_wanted =
        channel.topic == source_.topic || std::ranges::any_of(paths_, [&](const Path& path) {
          return topic_of(*path.column) == channel.topic;
        });
    if (!is_wanted) return nullptr;
    if (const std::string fault = logs::fault_of_encapsulation(channel.encoding, message.bytes);
        !fault.empty())
      throw InputError(source_.file.string(),
                       fmt::format("{}: its messages cannot be read: {}", channel.topic, fault),
                       "messages in CDR without parameter lists");
    readers = compile(channel);
    return readers.get();
  }

  std::unique_ptr<ChannelReaders> compile(const Channel& channel) {
    const Layout layout = layout_or_refuse(channel);
    auto readers = std::make_unique<ChannelReaders>();
    readers->makes_rows = source_.topic.empty() || channel.topic == source_.topic;
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      const auto& [path, column] = paths_[i];
      if (topic_of(*column) != channel.topic) continue;
      readers->columns.emplace_back(i, reader_or_refuse(layout, channel, path, place_of(*column)));
      if (column->kind != CellKind::text && readers->columns.back().second.is_text())
        throw InputError(place_of(*column), fmt::format("'{}' of {} is a text", path, channel.topic),
                         "a number");
      if (column->name.ends_with(kUp)) {
        if (!up_) up_.emplace(layout, channel.encoding);
        readers->up = &*up_;
      }
    }
    if (readers->makes_rows) readers->stamp = stamp_reader(layout, channel);
    if (logs::short_type_name(channel.type) == "sensor_msgs/NavSatFix")
      readers->status = reader_or_refuse(layout, channel, "status.status", source_.place);
    return readers;
  }

  Layout layout_or_refuse(const Channel& channel) const {
    try {
      return logs::layout_of(channel, definitions_);
    } catch (const logs::BadDefinition& error) {
      throw InputError(source_.file.string(), fmt::format("{}: {}", channel.topic, error.what()),
                       "messages whose definition is known");
    }
  }

  static FieldReader reader_or_refuse(const Layout& layout, const Channel& channel, const std::string& path,
                                      const std::string& where) {
    try {
      return FieldReader(layout, channel.encoding, path);
    } catch (const logs::UnknownField& error) {
      throw InputError(where, fmt::format("{}: {}", channel.topic, error.what()), error.expectation);
    }
  }

  /// Where recording.toml names none: that of a header, if there is one.
  std::optional<FieldReader> stamp_reader(const Layout& layout, const Channel& channel) {
    if (source_.time) {
      is_header_stamp_ = source_.time->name != "log_time";
      return reader_or_refuse(layout, channel, source_.time->name, place_of(*source_.time));
    }
    if (holds_) return std::nullopt;
    std::optional<FieldReader> reader = logs::reader_if_known(layout, channel.encoding, "header.stamp");
    if (reader) is_header_stamp_ = true;
    return reader;
  }

  void take_rows(const Message& message, const ChannelReaders& readers) {
    std::size_t rows = 0;
    for (const auto& [index, reader] : readers.columns) {
      held_[index].clear();
      reader.read_all(message, held_[index]);
      rows = std::max(rows, held_[index].size());
    }
    if (rows == 0) return;
    stamp_values_.clear();
    if (readers.stamp) readers.stamp->read_all(message, stamp_values_);
    for (std::size_t row = 0; row < rows; ++row) {
      push_stamp(message, readers, row);
      for (std::size_t i = 0; i < held_.size(); ++i) push_value(i, value_at(held_[i], i, row, readers));
    }
  }

  /// A single value goes to all rows of a message.
  static logs::Value value_at(const std::vector<logs::Value>& values, std::size_t index, std::size_t row,
                              const ChannelReaders& readers) {
    if (row < values.size()) return values[row];
    const auto reader = std::ranges::find(readers.columns, index, [](const auto& c) { return c.first; });
    const bool is_single =
        reader != readers.columns.end() && !reader->second.is_repeated() && values.size() == 1;
    return is_single ? values.front() : logs::Value();
  }

  void push_stamp(const Message& message, const ChannelReaders& readers, std::size_t row) {
    std::optional<std::int64_t> stamp = message.log_time_ns;
    if (readers.stamp) {
      const logs::Value value =
          stamp_values_.empty() ? logs::Value() : stamp_values_[std::min(row, stamp_values_.size() - 1)];
      stamp = nanoseconds_of(value, readers.stamp->is_time(), source_.time_scale.unit_exponent);
    }
    push_row(stamp.value_or(message.log_time_ns), message.log_time_ns);
  }

  void push_row(std::int64_t stamp, std::int64_t log_time) {
    stamps_.push_back(stamp);
    log_times_.push_back(log_time);
    ordinals_.append(messages_);
  }

  void push_value(std::size_t index, const logs::Value& value) {
    if (paths_[index].column->kind == CellKind::text) {
      texts_[index].push_back(text_of(value));
    } else {
      const double number = logs::number_of(value).value_or(kNotMeasured);
      const bool is_time = paths_[index].column->kind == CellKind::time;
      numbers_[index].push_back(!std::isfinite(number) ? kNotMeasured : (is_time ? time_of(value) : number));
    }
  }

  double time_of(const logs::Value& value) const {
    const auto nanoseconds = nanoseconds_of(value, true, 0);
    return nanoseconds ? seconds_of(*nanoseconds, source_.time_scale.origin_s) : kNotMeasured;
  }

  static std::string text_of(const logs::Value& value) {
    if (const auto* const text = std::get_if<std::string_view>(&value)) return std::string(*text);
    if (const auto* const number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number);
    if (const auto* const number = std::get_if<std::uint64_t>(&value)) return fmt::format("{}", *number);
    if (const auto* const number = std::get_if<double>(&value)) return fmt::format("{}", *number);
    return {};
  }

  // Columns of several topics: each keeps its last value, and a row is made once its instant is over.

  void take_held(const Message& message, const ChannelReaders& readers) {
    if (pending_ && is_over(*pending_, message)) push_held();
    if (source_.topic.empty()) written_.push_back(message.channel);
    for (const auto& [index, reader] : readers.columns) {
      const logs::Value value = reader.read(message);
      if (std::holds_alternative<std::monostate>(value)) continue;
      held_numbers_[index] = logs::number_of(value).value_or(kNotMeasured);
      held_texts_[index] = text_of(value);
    }
    if (!readers.makes_rows) return;
    std::optional<std::int64_t> stamp = message.log_time_ns;
    if (readers.stamp)
      stamp = nanoseconds_of(readers.stamp->read(message), readers.stamp->is_time(),
                             source_.time_scale.unit_exponent);
    const std::int64_t start = pending_ ? pending_->start : message.log_time_ns;
    pending_ = PendingRow{stamp.value_or(message.log_time_ns), message.log_time_ns, start};
  }

  /// Whether the instant of a row is over. Entries of one cycle of a robot's loop are written one after the
  /// other: they are one row, until one of them is written again.
  bool is_over(const PendingRow& row, const Message& message) const {
    if (message.log_time_ns == row.log_time) return false;
    constexpr std::int64_t kLongestCycle_ns = 5'000'000;  // loops run at 50 Hz, hardly at more than 200
    const bool is_again = std::ranges::find(written_, message.channel) != written_.end();
    return !source_.topic.empty() || is_again || message.log_time_ns - row.start > kLongestCycle_ns;
  }

  void push_held() {
    const PendingRow row = *pending_;
    pending_.reset();
    written_.clear();
    if (held_numbers_.size() < paths_.size()) return;  // not all of them were written yet
    push_row(row.stamp, row.log_time);
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      if (paths_[i].column->kind == CellKind::text)
        texts_[i].push_back(held_texts_[i]);
      else
        numbers_[i].push_back(std::isfinite(held_numbers_[i]) ? held_numbers_[i] : kNotMeasured);
    }
  }

  void take_column(std::size_t i, Table& table, std::vector<Finding>& findings, const std::string& name) {
    const ColumnSource& column = source_.columns[i];
    std::size_t value = first_value_[i];
    if (column.name.empty()) {
      table.numbers.emplace_back(stamps_.size(), kNotMeasured);
      table.texts.emplace_back(column.kind == CellKind::text ? stamps_.size() : 0);
      return;
    }
    double factor = column.scale;
    if (column.name.ends_with(kYaw)) take_yaw(value);
    if (column.name.ends_with(kUp) && source_.vertical) {
      take_vertical(value, *source_.vertical);
      report_axis(table, findings);
    } else if (column.name.ends_with(kUp) && up_) {
      const UpAxis::Answer up = up_->answer();
      value += up.axis;
      factor *= up.sign;
      report_axis(up, findings, name);
    }
    table.numbers.push_back(std::move(numbers_[value]));
    table.texts.push_back(std::move(texts_[value]));
    if (factor != 1.0)
      for (double& number : table.numbers.back()) number *= factor;
    require_plausible(table.numbers.back(), column, table.origin);
  }

  /// In place of the first of a quaternion's four. One of zeros says that there is none.
  void take_yaw(std::size_t first) {
    for (std::size_t row = 0; row < numbers_[first].size(); ++row) {
      const Quaternion q{numbers_[first][row], numbers_[first + 1][row], numbers_[first + 2][row],
                         numbers_[first + 3][row]};
      numbers_[first][row] = q.length2() > 0.0 ? yaw_of(q) : kNotMeasured;
    }
  }

  /// In place of the first of three axes: what of them is about the vertical.
  void take_vertical(std::size_t first, const std::array<double, 3>& vertical) {
    for (std::size_t row = 0; row < numbers_[first].size(); ++row)
      numbers_[first][row] = vertical[0] * numbers_[first][row] + vertical[1] * numbers_[first + 1][row] +
                             vertical[2] * numbers_[first + 2][row];
  }

  void report_axis(const Table& table, std::vector<Finding>& findings) const {
    const auto& [x, y, z] = *source_.vertical;
    findings.push_back({Severity::note,
                        FindingCode::gyro_axis,
                        table.origin.file,
                        1,
                        {fmt::format("({:.3g}, {:.3g}, {:.3g})", x, y, z)},
                        payload::Names{{source_.vertical_evidence}}});
  }

  static void report_axis(const UpAxis::Answer& up, std::vector<Finding>& findings, const std::string& name) {
    const std::string axis = fmt::format("{}{}", up.sign < 0.0 ? '-' : '+', "xyz"[up.axis]);
    if (up.evidence.empty())
      findings.push_back({Severity::note, FindingCode::gyro_axis, name, 1, {axis}, {}});
    else
      findings.push_back(
          {Severity::note, FindingCode::gyro_axis, name, 1, {axis}, payload::Names{{up.evidence}}});
  }

  /// Which stamps they are, and how far from the times at which messages were recorded. A publisher that
  /// leaves its stamps empty has none.
  void report_stamps(std::vector<Finding>& findings, const std::string& name) {
    if (!is_header_stamp_) return;
    if (std::ranges::all_of(stamps_, [](std::int64_t stamp) { return stamp == 0; })) {
      stamps_ = log_times_;
      findings.push_back({Severity::note, FindingCode::log_stamps, name, stamps_.size(), {}, {}});
      return;
    }
    findings.push_back(finding_of_stamps(stamps_, log_times_, name));
  }

  [[noreturn]] void refuse_empty() const {
    if (messages_ == 0)
      throw InputError(source_.place, fmt::format("{} has no message", place_name()),
                       "a topic with messages");
    throw InputError(
        source_.place,
        fmt::format("none of the {} messages of {} has the fields of the stream", messages_, place_name()),
        "paths that lead to what is in them");
  }

  const StreamSource& source_;
  const logs::Definitions& definitions_;
  std::vector<Path> paths_;
  std::vector<std::size_t> first_value_;  ///< of each of the source's columns among the paths
  bool holds_ = false;                    ///< columns are of several topics
  bool is_header_stamp_ = false;
  std::map<const Channel*, std::unique_ptr<ChannelReaders>> readers_;
  std::optional<UpAxis> up_;
  std::size_t messages_ = 0;
  std::vector<std::int64_t> stamps_, log_times_;
  LineMap ordinals_;  ///< of the row's message among those of its topic, from 1
  std::vector<std::vector<double>> numbers_;
  std::vector<std::vector<std::string>> texts_;
  std::vector<std::vector<logs::Value>> held_;  ///< of one message
  std::vector<logs::Value> stamp_values_;
  std::map<std::size_t, double> held_numbers_;  ///< of each path that was read already
  std::map<std::size_t, std::string> held_texts_;
  std::optional<PendingRow> pending_;
  std::vector<const Channel*> written_;  ///< in its instant
};

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
