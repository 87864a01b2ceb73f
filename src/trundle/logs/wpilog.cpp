// WPILOG 1.0, the data log of WPILib: entries that are started, written to and finished, each record with the
// identifier of its entry, a length and a time in microseconds, all of as many bytes as they need.
// https://github.com/wpilibsuite/allwpilib/blob/main/wpiutil/doc/datalog.adoc
#include <map>
#include <string>
#include <unordered_map>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/definitions.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"
#include "trundle/logs/detail/wpilib_struct.hpp"

namespace trundle::logs {
namespace {

constexpr std::size_t kHeadSize = 12;           // magic, version, length of the extra header
constexpr std::size_t kLongestRecordHead = 16;  // a byte of lengths, identifier 4, size 4, time 7
constexpr std::int64_t kNanosecondsOfTick = 1000;
constexpr std::uint16_t kMajorVersion = 1;  // the only one there is
constexpr std::string_view kStruct = "struct:";
constexpr std::string_view kSchemaOfStruct = ".schema/struct:";

enum ControlRecord : std::uint8_t { kStart = 0, kFinish = 1, kSetMetadata = 2 };

/// A type by itself: its value has one name everywhere.
Layout layout_of_value(std::string_view type, LayoutField value) {
  value.name = "value";
  return Layout({{.name = std::string(type), .fields = {std::move(value)}}});
}

/// Of the types that need no schema; nothing of others.
std::optional<Layout> layout_of_type(std::string_view type) {
  const auto is = [&](std::string_view name) { return type == name; };
  const auto one = [&](FieldType field) { return layout_of_value(type, {.name = {}, .type = field}); };
  const auto rest = [&](FieldType field) {
    return layout_of_value(type, {.name = {}, .type = field, .arity = FieldArity::rest});
  };
  if (is("boolean")) return one(FieldType::boolean);
  if (is("int64")) return one(FieldType::int64);
  if (is("float")) return one(FieldType::float32);
  if (is("double")) return one(FieldType::float64);
  if (is("boolean[]")) return rest(FieldType::boolean);
  if (is("int64[]")) return rest(FieldType::int64);
  if (is("float[]")) return rest(FieldType::float32);
  if (is("double[]")) return rest(FieldType::float64);
  if (is("string") || is("json") || is("structschema")) return rest(FieldType::character);
  if (is("string[]"))
    return layout_of_value(type, {.name = {}, .type = FieldType::string, .arity = FieldArity::dynamic});
  return std::nullopt;
}

/// "Pose2d" of "struct:Pose2d" and "struct:Pose2d[]"; empty: no structure.
std::string_view structure_in(std::string_view type) {
  if (!type.starts_with(kStruct)) return {};
  type.remove_prefix(kStruct.size());
  if (type.ends_with("[]")) type.remove_suffix(2);
  return type;
}

class WpilogLog final : public Log {
 public:
  WpilogLog(const std::filesystem::path& path, const Limits& limits) : file_(path), limits_(limits) {
    ByteCursor head(file_.peek(kHeadSize));
    head.take_bytes(6);  // the magic, which open_log() has seen
    const auto version = head.take<std::uint16_t>();
    const auto extra = head.take<std::uint32_t>();
    if (!head.is_good() || file_.left() - kHeadSize < extra)
      throw InputError(path.string(), "ends within the head of a WPILOG", "a whole head");
    if (version >> 8 != kMajorVersion)
      throw InputError(path.string(), fmt::format("is WPILOG of version {}.{}", version >> 8, version & 0xff),
                       "version 1");
    file_.skip(kHeadSize + std::uint64_t{extra});
  }

  std::string_view format() const override { return "WPILOG"; }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }
  bool is_written_on_change() const override { return true; }

  std::optional<Message> next() override {
    while (!cut_ && file_.left() > 0) {
      const std::optional<Record> record = next_record();
      if (!record) return std::nullopt;
      if (record->entry == 0) {
        take_control(record->payload);
        continue;
      }
      const auto entry = entries_.find(record->entry);
      if (entry == entries_.end()) continue;  // finished, or never started: the format says to leave it out
      take_schema(*entry->second, record->payload);
      complete(*entry->second);
      return Message{entry->second, record->time_ns, record->payload};
    }
    return std::nullopt;
  }

 private:
  struct Record {
    std::uint32_t entry = 0;
    std::int64_t time_ns = 0;
    std::span<const std::byte> payload;
  };

  std::nullopt_t end_here(std::string_view reason) {
    cut_ = Cut{file_.path().string(), file_.position(), std::string(reason)};
    return std::nullopt;
  }

  /// Passes it. Nothing where the file ends within it, which is then the cut.
  std::optional<Record> next_record() {
    ByteCursor head(file_.peek(kLongestRecordHead));
    const auto lengths = head.take<std::uint8_t>();
    const auto number = [&](int bytes) {
      std::uint64_t value = 0;
      for (int byte = 0; byte < bytes; ++byte)
        value |= std::uint64_t{head.take<std::uint8_t>()} << (8 * byte);
      return value;
    };
    Record record;
    record.entry = static_cast<std::uint32_t>(number((lengths & 3) + 1));
    const std::uint64_t size = number(((lengths >> 2) & 3) + 1);
    record.time_ns = static_cast<std::int64_t>(number(((lengths >> 4) & 7) + 1));
    if (!head.is_good()) return end_here("the file ends within the head of a record");
    const std::uint64_t head_size = file_.peek(kLongestRecordHead).size() - head.rest().size();
    if (size > limits_.largest_message)
      return end_here(fmt::format("a record of {} bytes is larger than any", size));
    if (size > file_.left() - head_size) return end_here("the file ends within a record");
    // Beyond that no clock since its start counts: 292 years in nanoseconds.
    constexpr std::int64_t kLatest = kLatestTime_ns / kNanosecondsOfTick;
    if (record.time_ns < 0 || record.time_ns > kLatest) return end_here("the time of a record is no time");
    record.time_ns *= kNanosecondsOfTick;
    record.payload =
        file_.peek(static_cast<std::size_t>(head_size + size)).subspan(static_cast<std::size_t>(head_size));
    file_.skip(head_size + size);  // the bytes stay until the next peek
    return record;
  }

  void take_control(std::span<const std::byte> payload) {
    ByteCursor cursor(payload);
    const auto kind = cursor.take<std::uint8_t>();
    const auto id = cursor.take<std::uint32_t>();
    if (!cursor.is_good()) return;
    if (kind == kStart) {
      start(id, cursor);
    } else if (kind == kFinish) {
      entries_.erase(id);
    } else if (kind == kSetMetadata) {
      const auto entry = entries_.find(id);
      const std::string_view metadata = cursor.take_text();
      if (entry != entries_.end() && cursor.is_good() && metadata.size() <= limits_.largest_definition)
        entry->second->metadata = metadata;
    }
  }

  /// An entry that was finished and starts again, under whatever identifier, is the same channel.
  void start(std::uint32_t id, ByteCursor& cursor) {
    Channel channel;
    channel.id = id;
    channel.topic = cursor.take_text();
    channel.type = cursor.take_text();
    channel.metadata = cursor.take_text();
    if (!cursor.is_good() || id == 0) return;
    Channel*& same = by_name_[channel.topic + '\0' + channel.type];
    if (same == nullptr) {
      text_bytes_ += channel.topic.size() + channel.type.size() + channel.metadata.size();
      if (channels_.size() == limits_.most_channels || text_bytes_ > limits_.all_definitions) {
        end_here("it starts more entries than any");
        return;
      }
      channel.layout = layout_of_type(channel.type);
      if (channel.layout) channel.encoding = Encoding::packed;
      same = &channels_.add(std::move(channel));
    }
    entries_[id] = same;
  }

  /// Keeps what an entry like "NT:/.schema/struct:Pose2d" says of a structure.
  void take_schema(const Channel& channel, std::span<const std::byte> payload) {
    const std::size_t at = channel.topic.find(kSchemaOfStruct);
    if (at == std::string::npos || channel.type != "structschema") return;
    schema_bytes_ += payload.size();
    if (schema_bytes_ > limits_.all_definitions) return;
    schemas_[channel.topic.substr(at + kSchemaOfStruct.size())] = text_of(payload);
    ++schema_count_;
  }

  /// Lays a structure out as soon as the schemas of it and all within are known.
  void complete(Channel& channel) {
    const std::string_view name = structure_in(channel.type);
    if (channel.layout || name.empty()) return;
    std::size_t& tried = tried_at_[&channel];
    if (tried == schema_count_) return;
    tried = schema_count_;
    try {
      channel.layout = layout_of_wpilib_struct(name, channel.type.ends_with("[]"), schemas_);
      channel.encoding = Encoding::packed;
      channel.definition = schemas_.find(name)->second;
    } catch (const BadDefinition&) {  // perhaps later; layout_of() says that there is none
    }
  }

  FileWindow file_;
  Limits limits_;
  ChannelList channels_;
  std::size_t text_bytes_ = 0;
  std::unordered_map<std::uint32_t, Channel*> entries_;  ///< that are started now
  std::map<std::string, Channel*> by_name_;              ///< and type
  WpilibSchemas schemas_;
  std::size_t schema_bytes_ = 0;
  std::size_t schema_count_ = 0;                              ///< that were written
  std::unordered_map<const Channel*, std::size_t> tried_at_;  ///< with how many schemas
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_wpilog(const std::filesystem::path& path, const Limits& limits) {
  return std::make_unique<WpilogLog>(path, limits);
}

}  // namespace trundle::logs
