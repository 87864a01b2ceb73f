#include <map>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/crc32.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"
#include "trundle/logs/detail/inflater.hpp"
#include "trundle/logs/detail/mcap_format.hpp"

namespace trundle::logs {
namespace {

constexpr std::size_t kLongestName = 64;                      // of a compression or an encoding
constexpr std::size_t kMcapHead = 1 + sizeof(std::uint64_t);  // opcode, length
/// From the footer's opcode to the end of the file.
constexpr std::size_t kMcapFooter =
    kMcapHead + 2 * sizeof(std::uint64_t) + sizeof(std::uint32_t) + kMcapMagic.size();

struct McapRecord {
  Opcode opcode = Opcode::none;
  std::uint64_t size = 0;
};

struct Schema {
  std::string name;
  std::string encoding;
  std::string definition;
};

SchemaLanguage language_named(std::string_view name) {
  if (name == "ros1msg") return SchemaLanguage::ros1msg;
  if (name == "ros2msg") return SchemaLanguage::ros2msg;
  if (name == "ros2idl") return SchemaLanguage::ros2idl;
  return SchemaLanguage::none;
}

Encoding encoding_named(std::string_view name) {
  if (name == "ros1") return Encoding::ros1;
  if (name == "cdr") return Encoding::cdr;
  if (name == "json") return Encoding::json;
  return Encoding::unknown;
}

class Mcap : public Log {
 public:
  Mcap(const std::filesystem::path& path, const Limits& limits) : file_(path), limits_(limits) {
    read_summary();
    cut_.reset();  // of the summary alone: the messages may all be there
    file_.seek(kMcapMagic.size());
  }

  std::string_view format() const override { return "MCAP"; }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }

  std::optional<Message> next() override {
    while (!cut_ && !is_at_end_) {
      const bool is_in_chunk = !chunk_.is_empty() || !chunk_fault_.empty();
      if (std::optional<Message> message = is_in_chunk ? next_in_chunk() : next_in_file()) return message;
    }
    return std::nullopt;
  }

 private:
  void end(std::uint64_t byte, std::string reason) {
    cut_ = Cut{file_.path().string(), byte, std::move(reason)};
  }

  McapRecord head_at_window() {
    ByteCursor cursor(file_.peek(kMcapHead));
    McapRecord record;
    record.opcode = static_cast<Opcode>(cursor.take<std::uint8_t>());
    record.size = cursor.take<std::uint64_t>();
    if (!cursor.is_good()) record = {};
    return record;
  }

  /// Schemas, channels and the numbers of messages, where a file that was closed repeats them at its end.
  void read_summary() {
    if (file_.size() < kMcapMagic.size() + kMcapFooter) return;
    file_.seek(file_.size() - kMcapFooter);
    if (head_at_window().opcode != Opcode::footer) return;
    file_.skip(kMcapHead);
    const auto start = ByteCursor(file_.peek(sizeof(std::uint64_t))).take<std::uint64_t>();
    const std::uint64_t summary_end = file_.size() - kMcapFooter;
    if (start < kMcapMagic.size() || start >= summary_end) return;
    file_.seek(start);
    while (file_.position() < summary_end && !cut_) {
      const McapRecord record = head_at_window();
      file_.skip(kMcapHead);
      const std::uint64_t content = file_.position();
      if (record.size > file_.left()) return;
      if (is_small(record)) take_small(record.opcode, file_.peek(static_cast<std::size_t>(record.size)));
      file_.seek(content + record.size);
    }
  }

  /// What says what messages are.
  bool is_small(const McapRecord& record) const {
    const bool is_of_interest = record.opcode == Opcode::schema || record.opcode == Opcode::channel ||
                                record.opcode == Opcode::statistics;
    return is_of_interest && record.size <= limits_.largest_definition;
  }

  void take_small(Opcode opcode, std::span<const std::byte> content) {
    if (opcode == Opcode::schema) take_schema(content);
    if (opcode == Opcode::channel) take_channel(content);
    if (opcode == Opcode::statistics) take_statistics(content);
  }

  void take_schema(std::span<const std::byte> content) {
    ByteCursor cursor(content);
    const auto id = cursor.take<std::uint16_t>();
    Schema schema;
    schema.name = cursor.take_text();
    schema.encoding = cursor.take_text();
    schema.definition = cursor.take_text();
    if (!cursor.is_good()) return end(file_.position(), "a schema is damaged");
    if (schemas_.contains(id)) return;
    if (!channels_.takes(content.size(), limits_)) return end(file_.position(), "the schemas are too large");
    schemas_.try_emplace(id, std::move(schema));
  }

  void take_channel(std::span<const std::byte> content) {
    ByteCursor cursor(content);
    const auto id = cursor.take<std::uint16_t>();
    const auto schema_id = cursor.take<std::uint16_t>();
    Channel channel{.id = id, .topic = std::string(cursor.take_text())};
    const std::string encoding(cursor.take_text().substr(0, kLongestName));
    channel.encoding = encoding_named(encoding);
    if (channel.encoding != Encoding::ros1 && channel.encoding != Encoding::cdr)
      channel.unreadable =
          fmt::format("its messages are encoded as '{}': those of ROS, ros1 and cdr, are read", encoding);
    if (!cursor.is_good()) return end(file_.position(), "a channel is damaged");
    if (by_id_.contains(id)) return;
    if (const auto schema = schemas_.find(schema_id); schema != schemas_.end()) {
      channel.type = schema->second.name;
      channel.language = language_named(schema->second.encoding);
      channel.definition = schema->second.definition;
    }
    if (!channels_.takes(content.size() + channel.type.size() + channel.definition.size(), limits_))
      return end(file_.position(), "there are too many channels, or their definitions are too large");
    by_id_[id] = &channels_.add(std::move(channel));
  }

  void take_statistics(std::span<const std::byte> content) {
    ByteCursor cursor(content);
    // Numbers of messages, schemas, channels, attachments, metadata and chunks; first and last time.
    cursor.take_bytes(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8);
    cursor.take<std::uint32_t>();  // bytes of the map
    while (!cursor.is_empty()) {
      const auto id = cursor.take<std::uint16_t>();
      const auto count = cursor.take<std::uint64_t>();
      if (const auto found = by_id_.find(id); found != by_id_.end() && cursor.is_good())
        found->second->messages = count;
    }
  }

  std::optional<Message> next_in_file() {
    const std::uint64_t start = file_.position();
    const McapRecord record = head_at_window();
    if (record.opcode == Opcode::data_end || record.opcode == Opcode::footer) {
      is_at_end_ = true;
      return std::nullopt;
    }
    if (file_.left() < kMcapHead) {
      end(start, file_.left() == 0 ? "the file was not closed: it ends without an end of its data"
                                   : "the file ends within a record");
      return std::nullopt;
    }
    file_.skip(kMcapHead);
    if (record.opcode == Opcode::chunk) {
      open_chunk(record, start);
      return std::nullopt;
    }
    if (record.size > file_.left()) {
      end(start, "the file ends within a record");
      return std::nullopt;
    }
    const std::uint64_t content = file_.position();
    file_.seek(content + record.size);
    if (record.opcode == Opcode::message) return take_file_message(record, content);
    if (is_small(record)) {
      file_.seek(content);
      take_small(record.opcode, file_.peek(static_cast<std::size_t>(record.size)));
      file_.seek(content + record.size);
    }
    return std::nullopt;
  }

  std::optional<Message> take_file_message(const McapRecord& record, std::uint64_t content) {
    if (record.size > limits_.largest_message) {
      end(content, fmt::format("a message has {} bytes", record.size));
      return std::nullopt;
    }
    file_.seek(content);
    const std::span<const std::byte> bytes = file_.peek(static_cast<std::size_t>(record.size));
    file_.seek(content + record.size);
    return message_of(bytes, content);
  }

  std::optional<Message> message_of(std::span<const std::byte> content, std::uint64_t place) {
    ByteCursor cursor(content);
    const auto id = cursor.take<std::uint16_t>();
    cursor.take<std::uint32_t>();  // sequence
    const auto log_time = cursor.take<std::uint64_t>();
    cursor.take<std::uint64_t>();  // when it was published
    const auto found = by_id_.find(id);
    if (!cursor.is_good() || found == by_id_.end()) {
      end(place, cursor.is_good() ? "a message is of no channel" : "a message is damaged");
      return std::nullopt;
    }
    if (log_time > static_cast<std::uint64_t>(kLatestTime_ns)) {
      end(place, "the time of a message is no time");
      return std::nullopt;
    }
    return Message{found->second, static_cast<std::int64_t>(log_time), cursor.rest()};
  }

  void open_chunk(const McapRecord& record, std::uint64_t start) {
    // Of a chunk's record: first and last time, size, and the check sum.
    constexpr std::size_t kBeforeName = 3 * sizeof(std::uint64_t) + sizeof(std::uint32_t);
    ByteCursor cursor(file_.peek(kBeforeName + sizeof(std::uint32_t) + kLongestName + sizeof(std::uint64_t)));
    cursor.take_bytes(2 * sizeof(std::uint64_t));  // first and last time
    const auto size = cursor.take<std::uint64_t>();
    const auto crc = cursor.take<std::uint32_t>();
    const std::string name(cursor.take_text());
    const auto compressed = cursor.take<std::uint64_t>();
    if (!cursor.is_good()) return end(start, "the file ends within a chunk, or the chunk is damaged");
    const std::optional<Compression> compression = compression_named(name);
    if (!compression) return end(start, fmt::format("a chunk is compressed by '{}'", name));
    if (size > limits_.largest_chunk || compressed > limits_.largest_chunk)
      return end(start, fmt::format("a chunk has {} bytes, {} once they are decompressed", compressed, size));
    const std::uint64_t records =
        file_.position() + kBeforeName + sizeof(std::uint32_t) + name.size() + sizeof(std::uint64_t);
    if (records + compressed > start + kMcapHead + record.size) return end(start, "a chunk is damaged");
    file_.seek(records);
    const std::span<const std::byte> bytes = file_.peek(static_cast<std::size_t>(compressed));
    const bool is_cut = bytes.size() < compressed;
    file_.seek(start + kMcapHead + record.size);
    Inflated inflated{bytes};
    if (*compression != Compression::none)
      inflated = inflater_.inflate(*compression, bytes, static_cast<std::size_t>(size));
    if (is_cut) inflated.fault = "the file ends within a chunk";
    if (inflated.fault.empty() && crc != 0 && crc32_of(inflated.bytes) != crc)
      return end(start, "the checksum of a chunk is wrong");
    chunk_ = ByteCursor(inflated.bytes);
    chunk_start_ = start;
    chunk_fault_ = std::move(inflated.fault);
  }

  std::optional<Message> next_in_chunk() {
    const auto opcode = static_cast<Opcode>(chunk_.take<std::uint8_t>());
    const std::span<const std::byte> content = chunk_.take_bytes(chunk_.take<std::uint64_t>());
    if (!chunk_.is_good()) {
      end(chunk_start_, chunk_fault_.empty() ? "the records of a chunk are damaged" : chunk_fault_);
      return std::nullopt;
    }
    if (opcode == Opcode::message) return message_of(content, chunk_start_);
    if (content.size() <= limits_.largest_definition) take_small(opcode, content);
    return std::nullopt;
  }

  FileWindow file_;
  Limits limits_;
  std::map<std::uint16_t, Schema> schemas_;
  ChannelList channels_;
  std::map<std::uint16_t, Channel*> by_id_;
  Inflater inflater_;
  ByteCursor chunk_{{}};  ///< what is left of one
  std::uint64_t chunk_start_ = 0;
  std::string chunk_fault_;  ///< that ends it before its end
  bool is_at_end_ = false;
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_mcap(const std::filesystem::path& path, const Limits& limits) {
  return std::make_unique<Mcap>(path, limits);
}

}  // namespace trundle::logs
