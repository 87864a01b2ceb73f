#include <map>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"
#include "trundle/logs/detail/file_window.hpp"
#include "trundle/logs/detail/formats.hpp"
#include "trundle/logs/detail/inflater.hpp"

namespace trundle::logs {
namespace {

// Version 2.0: http://wiki.ros.org/Bags/Format/2.0. Records of a header, which is fields "name=value", and
// data.

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";

/// The field "op" of a record.
enum class RecordKind : std::uint8_t {
  none = 0x00,
  message = 0x02,
  bag = 0x03,
  index = 0x04,
  chunk = 0x05,
  chunk_info = 0x06,
  connection = 0x07,
};

/// The fields of a header by name; the bytes are the record's.
using HeaderFields = std::map<std::string_view, std::span<const std::byte>>;

/// False where the bytes are no header.
bool read_header(std::span<const std::byte> bytes, HeaderFields& fields) {
  ByteCursor cursor(bytes);
  while (!cursor.is_empty() && cursor.is_good()) {
    const std::span<const std::byte> field = cursor.take_bytes(cursor.take<std::uint32_t>());
    const std::size_t equals = text_of(field).find('=');
    if (!cursor.is_good() || equals == std::string_view::npos) return false;
    fields.insert_or_assign(text_of(field.first(equals)), field.subspan(equals + 1));
  }
  return cursor.is_good();
}

template <class Number>
Number number_in(const HeaderFields& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? Number{} : ByteCursor(found->second).take<Number>();
}

std::string text_in(const HeaderFields& fields, std::string_view name) {
  const auto found = fields.find(name);
  return found == fields.end() ? std::string() : std::string(text_of(found->second));
}

/// ROS's time: seconds and nanoseconds.
std::int64_t time_in(const HeaderFields& fields) {
  const auto found = fields.find("time");
  if (found == fields.end()) return 0;
  ByteCursor cursor(found->second);
  const auto seconds = std::int64_t{cursor.take<std::uint32_t>()};
  return seconds * kNanosecondsPerSecond + cursor.take<std::uint32_t>();
}

/// A record within bytes.
struct BagRecord {
  RecordKind kind = RecordKind::none;
  HeaderFields header;
  std::uint32_t data_size = 0;
};

class Rosbag : public Log {
 public:
  Rosbag(const std::filesystem::path& path, const Limits& limits) : file_(path), limits_(limits) {
    if (text_of(file_.peek(kMagic.size())) != kMagic)
      throw InputError(path.string(), "is a ROS 1 bag of another version than 2.0",
                       "rosbag migrate's output");
    file_.skip(kMagic.size());
    read_index();
  }

  std::string_view format() const override { return "ROS 1 bag"; }
  std::span<const Channel* const> channels() const override { return channels_.all(); }
  const std::optional<Cut>& cut() const override { return cut_; }

  std::optional<Message> next() override {
    while (!cut_ && !is_at_end_) {
      if (!chunk_.is_empty()) {
        if (std::optional<Message> message = next_in_chunk()) return message;
      } else if (std::optional<Message> message = next_in_file()) {
        return message;
      }
    }
    return std::nullopt;
  }

 private:
  static constexpr std::size_t kLength = sizeof(std::uint32_t);

  void end(std::uint64_t byte, std::string reason) {
    cut_ = Cut{file_.path().string(), byte, std::move(reason)};
  }

  /// The head of the record at the window's place, which moves to its data. False at the end of the file, and
  /// where it is cut.
  bool take_head(BagRecord& record) {
    const std::uint64_t start = file_.position();
    if (file_.left() == 0) return false;
    const auto header_size = ByteCursor(file_.peek(kLength)).take<std::uint32_t>();
    if (file_.left() < kLength || header_size > file_.left() - kLength ||
        kLength > file_.left() - kLength - header_size) {
      end(start, "the file ends within a record");
      return false;
    }
    if (header_size > limits_.largest_definition) {
      end(start, fmt::format("the header of a record has {} bytes", header_size));
      return false;
    }
    const std::span<const std::byte> bytes = file_.peek(2 * kLength + header_size);
    header_.assign(bytes.begin() + kLength, bytes.begin() + kLength + header_size);
    record.data_size = ByteCursor(bytes.subspan(kLength + header_size)).take<std::uint32_t>();
    record.header.clear();
    if (!read_header(header_, record.header)) {
      end(start, "the header of a record is damaged");
      return false;
    }
    record.kind = static_cast<RecordKind>(number_in<std::uint8_t>(record.header, "op"));
    file_.skip(2 * kLength + header_size);
    return true;
  }

  /// The connections and numbers of messages at the end of a bag that was closed.
  void read_index() {
    const std::uint64_t start = file_.position();
    BagRecord record;
    if (!take_head(record) || record.kind != RecordKind::bag)
      throw InputError(file_.path().string(), "has no bag header, or breaks off in it", "a ROS 1 bag");
    const auto index = number_in<std::uint64_t>(record.header, "index_pos");
    const std::uint64_t first = file_.position() + record.data_size;
    is_closed_ = index > start && index < file_.size();
    if (is_closed_) {
      file_.seek(index);
      while (!cut_ && take_head(record)) {
        const std::uint64_t data = file_.position();
        if (record.kind == RecordKind::connection) take_connection(record);
        if (record.kind == RecordKind::chunk_info) take_chunk_info(record);
        file_.seek(data + record.data_size);
      }
    }
    cut_.reset();  // of the index alone: the messages may all be there
    file_.seek(first);
  }

  /// Its data is at the window's place.
  void take_connection(const BagRecord& record) {
    const std::uint64_t start = file_.position();
    if (record.data_size > file_.left()) return end(start, "the file ends within a connection");
    if (record.data_size > limits_.largest_definition)
      return end(start, fmt::format("a connection has {} bytes", record.data_size));
    add_connection(record, file_.peek(record.data_size));
  }

  void add_connection(const BagRecord& record, std::span<const std::byte> data) {
    const auto id = number_in<std::uint32_t>(record.header, "conn");
    HeaderFields fields;
    if (by_id_.contains(id)) return;
    if (!channels_.takes(data.size(), limits_))
      return end(file_.position(), "there are too many connections, or their definitions are too large");
    if (!read_header(data, fields)) return end(file_.position(), "a connection is damaged");
    by_id_[id] = &channels_.add({.id = id,
                                 .topic = text_in(record.header, "topic"),
                                 .type = text_in(fields, "type"),
                                 .encoding = Encoding::ros1,
                                 .language = SchemaLanguage::ros1msg,
                                 .definition = text_in(fields, "message_definition")});
  }

  void take_chunk_info(const BagRecord& record) {
    if (record.data_size > limits_.largest_definition) return;
    ByteCursor counts(file_.peek(record.data_size));
    while (!counts.is_empty()) {
      const auto id = counts.take<std::uint32_t>();
      const auto count = counts.take<std::uint32_t>();
      if (const auto found = by_id_.find(id); found != by_id_.end() && counts.is_good())
        found->second->messages = found->second->messages.value_or(0) + count;
    }
  }

  std::optional<Message> next_in_file() {
    const std::uint64_t start = file_.position();
    BagRecord record;
    if (!take_head(record)) {
      is_at_end_ = true;
      if (!cut_ && !is_closed_) end(file_.size(), "the bag was not closed: it has no index");
      return std::nullopt;
    }
    const std::uint64_t data = file_.position();
    if (record.kind == RecordKind::chunk) {
      open_chunk(record);
      return std::nullopt;
    }
    if (record.kind == RecordKind::connection) take_connection(record);
    if (record.kind == RecordKind::message) return take_message(record, start);
    if (record.data_size > file_.left()) end(start, "the file ends within a record");
    file_.seek(data + record.data_size);
    return std::nullopt;
  }

  std::optional<Message> take_message(const BagRecord& record, std::uint64_t start) {
    if (record.data_size > file_.left()) {
      end(start, "the file ends within a message");
      return std::nullopt;
    }
    if (record.data_size > limits_.largest_message) {
      end(start, fmt::format("a message has {} bytes", record.data_size));
      return std::nullopt;
    }
    const std::span<const std::byte> bytes = file_.peek(record.data_size);
    file_.skip(record.data_size);
    return message_of(record, bytes);
  }

  std::optional<Message> message_of(const BagRecord& record, std::span<const std::byte> bytes) {
    const auto found = by_id_.find(number_in<std::uint32_t>(record.header, "conn"));
    if (found == by_id_.end()) {
      end(file_.position(), "a message is of no connection");
      return std::nullopt;
    }
    return Message{found->second, time_in(record.header), bytes};
  }

  /// The records of a chunk that is not compressed are read as if they stood in the file.
  void open_chunk(const BagRecord& record) {
    const std::uint64_t start = file_.position();
    const std::string name = text_in(record.header, "compression");
    const std::optional<Compression> compression = compression_named(name);
    const auto size = number_in<std::uint32_t>(record.header, "size");
    if (!compression) return end(start, fmt::format("a chunk is compressed by '{}'", name));
    if (*compression == Compression::none) return;
    if (record.data_size > limits_.largest_chunk || size > limits_.largest_chunk)
      return end(start,
                 fmt::format("a chunk has {} bytes, {} once they are decompressed", record.data_size, size));
    const std::span<const std::byte> bytes = file_.peek(record.data_size);
    file_.skip(record.data_size);
    Inflated inflated = inflater_.inflate(*compression, bytes, size);
    chunk_ = ByteCursor(inflated.bytes);
    chunk_start_ = start;
    chunk_fault_ =
        bytes.size() < record.data_size ? "the file ends within a chunk" : std::move(inflated.fault);
    if (chunk_.is_empty() && !chunk_fault_.empty()) end(start, chunk_fault_);
  }

  std::optional<Message> next_in_chunk() {
    BagRecord record;
    const std::span<const std::byte> header = chunk_.take_bytes(chunk_.take<std::uint32_t>());
    const bool is_header = read_header(header, record.header);
    const std::span<const std::byte> data = chunk_.take_bytes(chunk_.take<std::uint32_t>());
    const bool is_whole = chunk_.is_good() && is_header;
    if (!is_whole) {
      end(chunk_start_, chunk_fault_.empty() ? "the records of a chunk are damaged" : chunk_fault_);
      return std::nullopt;
    }
    // The last that comes before a fault.
    if (chunk_.is_empty() && !chunk_fault_.empty()) end(chunk_start_, chunk_fault_);
    record.kind = static_cast<RecordKind>(number_in<std::uint8_t>(record.header, "op"));
    if (record.kind == RecordKind::connection) {
      if (data.size() > limits_.largest_definition)
        end(chunk_start_, fmt::format("a connection has {} bytes", data.size()));
      else
        add_connection(record, data);
    }
    if (record.kind != RecordKind::message) return std::nullopt;
    return message_of(record, data);
  }

  FileWindow file_;
  Limits limits_;
  std::vector<std::byte> header_;  ///< of the record that is read
  ChannelList channels_;
  std::map<std::uint32_t, Channel*> by_id_;
  Inflater inflater_;
  ByteCursor chunk_{{}};  ///< what is left of one that was compressed
  std::uint64_t chunk_start_ = 0;
  std::string chunk_fault_;
  bool is_closed_ = false;
  bool is_at_end_ = false;
  std::optional<Cut> cut_;
};

}  // namespace

std::unique_ptr<Log> open_rosbag(const std::filesystem::path& path, const Limits& limits) {
  return std::make_unique<Rosbag>(path, limits);
}

}  // namespace trundle::logs
