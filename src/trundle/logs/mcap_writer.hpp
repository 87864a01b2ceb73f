#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "trundle/io/pieces.hpp"
#include "trundle/logs/detail/byte_writer.hpp"

namespace trundle::logs {

/// An MCAP file of ROS 2 messages (profile "ros2"), written as they come: chunks of 1 MB compressed by zstd,
/// an index of each, and at the end a summary with schemas, channels, statistics and all indices. Of what was
/// written it keeps some 200 bytes for each chunk. https://mcap.dev/spec
class McapWriter {
 public:
  /// `take` has the bytes as they come, and must outlive it. `library` names who writes.
  McapWriter(const TakeText& take, std::string_view library);
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// What the file says of itself, beside its messages.
  void add_metadata(std::string_view name, const std::map<std::string, std::string>& entries);
  /// A topic for messages of a type of ROS 2 whose definition is built in: "nav_msgs/msg/Odometry".
  [[nodiscard]] std::uint16_t add_channel(std::string_view topic, std::string_view type);
  /// A message as CdrWriter has it, with the time of its stamp, from 0 on. Times are in any order; in order
  /// within a topic they are read fastest.
  void add(std::uint16_t channel, std::int64_t time_ns, std::string_view message);
  /// Writes what is left, and the summary: without it the file counts as one that was not closed.
  void finish();

 private:
  struct Compressor;

  /// The times of messages, from the first to the last.
  struct Span {
    std::uint64_t first_ns = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t last_ns = 0;

    void include(std::uint64_t time_ns);
    /// 0 where there is none.
    [[nodiscard]] std::uint64_t start_ns() const { return first_ns <= last_ns ? first_ns : 0; }
  };

  void write(std::string_view bytes);
  void end_chunk();
  /// The records of one kind in the summary, and where they are.
  void write_group(std::uint8_t opcode, std::string_view records, ByteWriter& offsets);

  const TakeText& take_;
  std::uint64_t position_ = 0;  ///< in the file
  std::uint32_t crc_ = 0;       ///< of all bytes since the start, or since that of the summary
  ByteWriter schemas_;          ///< records, as the summary repeats them
  ByteWriter channels_;
  ByteWriter metadata_indices_;
  ByteWriter chunk_indices_;
  std::map<std::string, std::uint16_t, std::less<>> schema_ids_;
  std::vector<std::uint32_t> counts_;  ///< of messages, by channel
  std::uint32_t chunks_ = 0;
  std::uint32_t metadata_ = 0;
  Span span_;

  ByteWriter chunk_;  ///< records that are not written yet
  Span chunk_span_;
  /// Of these, by channel: time and place in the chunk.
  std::vector<std::vector<std::pair<std::uint64_t, std::uint64_t>>> index_;
  std::unique_ptr<Compressor> compressor_;
};

}  // namespace trundle::logs
