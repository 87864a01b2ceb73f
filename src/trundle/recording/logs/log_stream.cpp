#include "trundle/recording/logs/detail/log_stream.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/csv/detail/cells.hpp"

namespace trundle::recording {

using logs::Channel;
using logs::FieldReader;
using logs::Layout;
using logs::Message;

namespace {

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

}  // namespace

LogStream::LogStream(const StreamSource& source, const logs::Definitions& definitions)
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

void LogStream::take(const Message& message) {
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

std::optional<std::int64_t> LogStream::first_stamp() const {
  if (stamps_.empty()) return std::nullopt;
  const bool has_none = is_header_stamp_ && stamps_.front() == 0;
  return has_none ? log_times_.front() : stamps_.front();
}

void LogStream::add_parts(const ColumnSource& column, std::string_view ending,
                          std::initializer_list<std::string_view> parts) {
  const std::string stem = column.name.substr(0, column.name.size() - ending.size());
  for (const std::string_view part : parts) paths_.push_back({stem + std::string(part), &column});
}

const std::string& LogStream::topic_of(const ColumnSource& column) const {
  return column.topic.empty() ? source_.topic : column.topic;
}

std::string LogStream::place_name() const {
  const std::string& topic = source_.topic.empty() ? source_.columns.front().topic : source_.topic;
  return fmt::format("{} {}", source_.file.string(), topic);
}

const std::string& LogStream::place_of(const ColumnSource& column) const {
  return column.place.empty() ? source_.place : column.place;
}

ChannelReaders* LogStream::readers_of(const Message& message) {
  const Channel& channel = *message.channel;
  if (const auto found = readers_.find(&channel); found != readers_.end()) return found->second.get();
  std::unique_ptr<ChannelReaders>& readers = readers_[&channel];
  const bool is_wanted = channel.topic == source_.topic || std::ranges::any_of(paths_, [&](const Path& path) {
                           return topic_of(*path.column) == channel.topic;
                         });
  if (!is_wanted) return nullptr;
  if (const std::string fault = logs::fault_of_encapsulation(channel.encoding, message.bytes); !fault.empty())
    throw InputError(source_.file.string(),
                     fmt::format("{}: its messages cannot be read: {}", channel.topic, fault),
                     "messages in CDR without parameter lists");
  readers = compile(channel);
  return readers.get();
}

std::unique_ptr<ChannelReaders> LogStream::compile(const Channel& channel) {
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

Layout LogStream::layout_or_refuse(const Channel& channel) const {
  try {
    return logs::layout_of(channel, definitions_);
  } catch (const logs::BadDefinition& error) {
    throw InputError(source_.file.string(), fmt::format("{}: {}", channel.topic, error.what()),
                     "messages whose definition is known");
  }
}

FieldReader LogStream::reader_or_refuse(const Layout& layout, const Channel& channel, const std::string& path,
                                        const std::string& where) {
  try {
    return FieldReader(layout, channel.encoding, path);
  } catch (const logs::UnknownField& error) {
    throw InputError(where, fmt::format("{}: {}", channel.topic, error.what()), error.expectation);
  }
}

std::optional<FieldReader> LogStream::stamp_reader(const Layout& layout, const Channel& channel) {
  if (source_.time) {
    is_header_stamp_ = source_.time->name != "log_time";
    return reader_or_refuse(layout, channel, source_.time->name, place_of(*source_.time));
  }
  if (holds_) return std::nullopt;
  std::optional<FieldReader> reader = logs::reader_if_known(layout, channel.encoding, "header.stamp");
  if (reader) is_header_stamp_ = true;
  return reader;
}

void LogStream::take_rows(const Message& message, const ChannelReaders& readers) {
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

logs::Value LogStream::value_at(const std::vector<logs::Value>& values, std::size_t index, std::size_t row,
                                const ChannelReaders& readers) {
  if (row < values.size()) return values[row];
  const auto reader = std::ranges::find(readers.columns, index, [](const auto& c) { return c.first; });
  const bool is_single =
      reader != readers.columns.end() && !reader->second.is_repeated() && values.size() == 1;
  return is_single ? values.front() : logs::Value();
}

void LogStream::push_stamp(const Message& message, const ChannelReaders& readers, std::size_t row) {
  std::optional<std::int64_t> stamp = message.log_time_ns;
  if (readers.stamp) {
    const logs::Value value =
        stamp_values_.empty() ? logs::Value() : stamp_values_[std::min(row, stamp_values_.size() - 1)];
    stamp = nanoseconds_of(value, readers.stamp->is_time(), source_.time_scale.unit_exponent);
  }
  push_row(stamp.value_or(message.log_time_ns), message.log_time_ns);
}

void LogStream::push_row(std::int64_t stamp, std::int64_t log_time) {
  stamps_.push_back(stamp);
  log_times_.push_back(log_time);
  ordinals_.append(messages_);
}

void LogStream::push_value(std::size_t index, const logs::Value& value) {
  if (paths_[index].column->kind == CellKind::text) {
    texts_[index].push_back(text_of(value));
  } else {
    const double number = logs::number_of(value).value_or(kNotMeasured);
    const bool is_time = paths_[index].column->kind == CellKind::time;
    numbers_[index].push_back(!std::isfinite(number) ? kNotMeasured : (is_time ? time_of(value) : number));
  }
}

double LogStream::time_of(const logs::Value& value) const {
  const auto nanoseconds = nanoseconds_of(value, true, 0);
  return nanoseconds ? seconds_of(*nanoseconds, source_.time_scale.origin_s) : kNotMeasured;
}

std::string LogStream::text_of(const logs::Value& value) {
  if (const auto* const text = std::get_if<std::string_view>(&value)) return std::string(*text);
  if (const auto* const number = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *number);
  if (const auto* const number = std::get_if<std::uint64_t>(&value)) return fmt::format("{}", *number);
  if (const auto* const number = std::get_if<double>(&value)) return fmt::format("{}", *number);
  return {};
}

void LogStream::take_held(const Message& message, const ChannelReaders& readers) {
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

bool LogStream::is_over(const PendingRow& row, const Message& message) const {
  if (message.log_time_ns == row.log_time) return false;
  constexpr std::int64_t kLongestCycle_ns = 5'000'000;  // loops run at 50 Hz, hardly at more than 200
  const bool is_again = std::ranges::find(written_, message.channel) != written_.end();
  return !source_.topic.empty() || is_again || message.log_time_ns - row.start > kLongestCycle_ns;
}

void LogStream::push_held() {
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

}  // namespace trundle::recording
