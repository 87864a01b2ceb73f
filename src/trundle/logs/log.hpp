#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "trundle/logs/layout.hpp"

namespace trundle::logs {

/// How the bytes of a message stand for its fields.
enum class Encoding {
  ros1,    ///< little-endian without padding; strings and dynamic arrays after their length, as 32 bits
  cdr,     ///< OMG's Common Data Representation, XCDR1 or XCDR2, after its header of four bytes
  packed,  ///< as ros1 with what Layout says besides: WPILOG, DataFlash, ULog
  json,
  unknown,
};

/// The language of a channel's definition.
enum class SchemaLanguage { none, ros1msg, ros2msg, ros2idl };

/// What messages of one kind are sent on: a topic, an entry, a message of a format's own.
struct Channel {
  std::uint32_t id = 0;  ///< of the format
  std::string topic = {};
  std::string type = {};  ///< as the log names it: "sensor_msgs/Imu", "sensor_msgs/msg/Imu", "double"
  Encoding encoding = Encoding::unknown;
  SchemaLanguage language = SchemaLanguage::none;
  std::string definition = {};        ///< empty: the log holds none
  std::optional<Layout> layout = {};  ///< where the format itself lays messages out, not a definition
  std::optional<std::uint64_t> messages = {};  ///< as the log's index counts them, where it has one
  std::string metadata = {};                   ///< what the format says besides, as it stands there (WPILOG)
  bool has_time = true;         ///< its messages bear one; else they have that of the message before
  std::string unreadable = {};  ///< why its messages cannot be decoded; empty: the definition decides
};

inline constexpr double kNanosecond_s = 1e-9;
/// In 2115, and so that differences of times are no overflow either: what is later, or before 0, is damage.
inline constexpr std::int64_t kLatestTime_ns = 4'600'000'000'000'000'000;

struct Message {
  const Channel* channel = nullptr;
  std::int64_t log_time_ns = 0;      ///< when it was recorded, on the log's clock
  std::span<const std::byte> bytes;  ///< valid until the log is asked for the next
};

/// What a log may ask for before it is refused as crafted or damaged.
struct Limits {
  std::size_t largest_message = std::size_t{64} << 20;    ///< and record of a file [bytes]
  std::size_t largest_chunk = std::size_t{64} << 20;      ///< of messages, uncompressed [bytes]
  std::size_t largest_definition = std::size_t{1} << 20;  ///< of one channel [bytes]
  std::size_t all_definitions = std::size_t{8} << 20;  ///< of all channels together, with their names [bytes]
  std::size_t most_channels = std::size_t{1} << 16;
  std::uint64_t largest_database = std::uint64_t{16}
                                   << 30;  ///< that a compressed one becomes on the disk [bytes]
};

/// Where and why a log ends before its end.
struct Cut {
  std::string place;       ///< the file
  std::uint64_t byte = 0;  ///< of the file, from its start; 0: the format has no such place
  std::string reason;      ///< "the file ends within a chunk"
};

/// A piece of a file that is no message, with messages again behind it.
struct Loss {
  std::uint64_t byte = 0;   ///< where it begins, from the start of the file
  std::uint64_t bytes = 0;  ///< its length
};
/// Of so many each is known by its place; those behind are added to the last.
inline constexpr std::size_t kMostLosses = 1000;

/// The messages of a log, one pass from its start to its end. What it keeps does not grow with the file.
class Log {
 public:
  virtual ~Log() = default;

  /// "ROS 1 bag", "MCAP": as people call it.
  [[nodiscard]] virtual std::string_view format() const = 0;
  /// Those known so far: all of them before the first message where the file has an index, none that it does
  /// not yet have where it has none. They stay where they are.
  [[nodiscard]] virtual std::span<const Channel* const> channels() const = 0;
  /// In the order of the file; nothing at its end, or where it is cut.
  [[nodiscard]] virtual std::optional<Message> next() = 0;
  /// After the last message: nothing where the log is whole.
  [[nodiscard]] virtual const std::optional<Cut>& cut() const = 0;
  /// A value is written where it changes, not at a rate: each holds until the next of its topic.
  [[nodiscard]] virtual bool is_written_on_change() const { return false; }
  /// What was passed over so far, in formats that can be taken up again behind damage.
  [[nodiscard]] virtual std::span<const Loss> losses() const { return {}; }
};

/// Opens a log of whatever format: told by its first bytes, not by its name; a folder by its metadata.yaml
/// (rosbag2). Throws InputError where it is none of them, or nothing of it can be read.
[[nodiscard]] std::unique_ptr<Log> open_log(const std::filesystem::path& path, const Limits& limits = {});

/// Whether open_log() would know the format. False of what does not exist.
[[nodiscard]] bool is_log(const std::filesystem::path& path);

}  // namespace trundle::logs
