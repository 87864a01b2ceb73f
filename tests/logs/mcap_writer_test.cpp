#include "trundle/logs/mcap_writer.hpp"

#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include "trundle/logs/cdr_writer.hpp"
#include "trundle/logs/detail/byte_cursor.hpp"

#include "logs/read_log.hpp"

namespace trundle::test {
namespace {

using testing::ElementsAre;
using testing::Pair;
using testing::SizeIs;

/// A file with `count` poses on one topic and as many texts on another, whose times run backwards.
std::string mcap_with(int count, std::vector<std::string>* lines = nullptr) {
  std::string bytes;
  const TakeText take = [&](std::string_view piece) { bytes += piece; };
  McapWriter file(take, "test 1");
  file.add_metadata("about", {{"seed", "7"}, {"what", "a test"}});
  const std::uint16_t poses = file.add_channel("/pose", "geometry_msgs/msg/Pose2D");
  const std::uint16_t texts = file.add_channel("/text", "std_msgs/msg/String");
  CdrWriter message;
  for (int i = 0; i < count; ++i) {
    message.clear();
    message.put(0.5 * i).put(-1.0 * i).put(1.0 / (i + 1));
    file.add(poses, 1'000'000'000'000LL + 1000 * i, message.bytes());
    message.clear();
    message.text(std::string(static_cast<std::size_t>(i % 100), 'x'));
    file.add(texts, 2'000'000'000'000LL - 1000 * i, message.bytes());
    if (lines == nullptr) continue;
    lines->push_back(
        fmt::format("{} /pose: x={} y={} theta={}", 1'000'000'000 + i, 0.5 * i, -1.0 * i, 1.0 / (i + 1)));
    lines->push_back(fmt::format("{} /text: data='{}'", 2'000'000'000 - i, std::string(i % 100, 'x')));
  }
  file.finish();
  return bytes;
}

TEST(McapWriter, IsReadAsItWasWritten) {
  std::vector<std::string> lines;
  const LogContent content = read_log(mcap_with(20'000, &lines));  // several chunks
  EXPECT_FALSE(content.cut) << content.cut->reason;
  EXPECT_EQ(content.lines, lines);
}

TEST(McapWriter, HasItsChannelsBeforeTheFirstMessageIsRead) {
  const LogFile file(mcap_with(10));
  const auto log = open_log(file.path());
  ASSERT_THAT(log->channels(), SizeIs(2));
  EXPECT_EQ(log->channels()[0]->messages, 10);
  EXPECT_EQ(log->channels()[1]->type, "std_msgs/msg/String");
}

TEST(McapWriter, WithoutMessagesIsAWholeFile) {
  const LogContent content = read_log(mcap_with(0));
  EXPECT_FALSE(content.cut) << content.cut->reason;
  EXPECT_THAT(content.lines, SizeIs(0));
}

/// CRC-32 bit by bit.
std::uint32_t slow_crc32(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const char byte : bytes) {
    crc ^= static_cast<unsigned char>(byte);
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320 : 0U);
  }
  return ~crc;
}

/// A record of the file, with its place.
struct FoundRecord {
  std::uint64_t start = 0;
  int opcode = 0;
  std::string_view content;

  ByteCursor cursor() const { return ByteCursor(std::as_bytes(std::span(content))); }
  std::uint64_t end() const { return start + 9 + content.size(); }
};

FoundRecord record_at(std::string_view file, std::uint64_t place) {
  ByteCursor cursor(std::as_bytes(std::span(file.substr(place))));
  FoundRecord record{.start = place, .opcode = cursor.take<std::uint8_t>(), .content = {}};
  record.content = file.substr(place + 9, cursor.take<std::uint64_t>());
  return record;
}

std::vector<FoundRecord> records_in(std::string_view file) {
  std::vector<FoundRecord> records;
  for (std::uint64_t place = 8; place + 8 < file.size(); place = records.back().end())
    records.push_back(record_at(file, place));
  return records;
}

TEST(McapWriter, ChecksumsCoverDataAndSummary) {
  const std::string file = mcap_with(20'000);
  const std::vector<FoundRecord> records = records_in(file);
  const FoundRecord& footer = records.back();
  ASSERT_EQ(footer.opcode, 2);
  ByteCursor cursor = footer.cursor();
  const auto summary = cursor.take<std::uint64_t>();
  const auto offsets = cursor.take<std::uint64_t>();
  EXPECT_EQ(cursor.take<std::uint32_t>(),
            slow_crc32(std::string_view(file).substr(summary, footer.start + 25 - summary)));
  EXPECT_EQ(record_at(file, offsets).opcode, 14);
  for (const FoundRecord& record : records)
    if (record.opcode == 15) {
      EXPECT_EQ(record.end(), summary);
      EXPECT_EQ(record.cursor().take<std::uint32_t>(),
                slow_crc32(std::string_view(file).substr(0, record.start)));
    }
}

/// Every message is found by the indices, at its time, in the order of times.
TEST(McapWriter, IndicesLeadToEveryMessage) {
  const std::string file = mcap_with(20'000);
  std::map<int, int> found;
  int chunks = 0;
  for (const FoundRecord& index : records_in(file)) {
    if (index.opcode != 8) continue;
    ++chunks;
    ByteCursor cursor = index.cursor();
    const auto first = cursor.take<std::uint64_t>(), last = cursor.take<std::uint64_t>();
    const FoundRecord chunk = record_at(file, cursor.take<std::uint64_t>());
    ASSERT_EQ(chunk.opcode, 6);
    EXPECT_EQ(cursor.take<std::uint64_t>(), chunk.end() - chunk.start);
    ByteCursor places(std::as_bytes(std::span(cursor.take_text())));
    ByteCursor body = chunk.cursor();
    EXPECT_EQ(body.take<std::uint64_t>(), first);
    EXPECT_EQ(body.take<std::uint64_t>(), last);
    std::string plain(body.take<std::uint64_t>(), '\0');
    const auto crc = body.take<std::uint32_t>();
    EXPECT_EQ(body.take_text(), "zstd");
    const std::span<const std::byte> packed = body.take_bytes(body.take<std::uint64_t>());
    ASSERT_EQ(ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size()), plain.size());
    EXPECT_EQ(crc, slow_crc32(plain));
    while (!places.is_empty()) {
      const auto channel = places.take<std::uint16_t>();
      const FoundRecord message_index = record_at(file, places.take<std::uint64_t>());
      ASSERT_EQ(message_index.opcode, 7);
      ByteCursor entries = message_index.cursor();
      EXPECT_EQ(entries.take<std::uint16_t>(), channel);
      entries.take<std::uint32_t>();
      for (std::uint64_t before = first; !entries.is_empty(); ++found[channel]) {
        const auto time = entries.take<std::uint64_t>();
        const FoundRecord message = record_at(plain, entries.take<std::uint64_t>());
        ByteCursor head = message.cursor();
        EXPECT_EQ(message.opcode, 5);
        EXPECT_EQ(head.take<std::uint16_t>(), channel);
        head.take<std::uint32_t>();
        EXPECT_EQ(head.take<std::uint64_t>(), time);
        EXPECT_GE(time, before);
        before = time;
      }
    }
  }
  EXPECT_GT(chunks, 1);
  EXPECT_THAT(found, ElementsAre(Pair(0, 20'000), Pair(1, 20'000)));
}

}  // namespace
}  // namespace trundle::test
