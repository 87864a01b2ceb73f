#include "trundle/logs/wpilog_writer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "logs/packed_writers.hpp"
#include "logs/read_log.hpp"

namespace trundle::test {
namespace {

using testing::ElementsAre;

/// Lengths of names, sizes and times that need one byte and all of them.
TEST(WpilogWriterOfResults, IsReadAsItWasWritten) {
  std::string bytes;
  const TakeText take = [&](std::string_view piece) { bytes += piece; };
  logs::WpilogWriter file(take, "about this file");
  const std::uint32_t text = file.start("/a", "string", 0);
  const std::uint32_t numbers = file.start("/b", "double[]", 5);
  file.add(text, 0, "");
  file.add(numbers, 255, bytes_of_number(0.5) + bytes_of_number(-2.0));
  file.add(text, 256, std::string(300, 'x'));
  file.add(text, 1'764'000'000'000'000, "now");
  file.finish();
  const LogContent content = read_log(bytes);
  EXPECT_FALSE(content.cut);
  EXPECT_THAT(content.lines, ElementsAre("0 /a: value=''", "255 /b: value[0]=0.5 value[1]=-2",
                                         "256 /a: value='" + std::string(300, 'x') + "'",
                                         "1764000000000000 /a: value='now'"));
}

/// As WPILib's own writer has the least record: one byte each for entry, size and time.
TEST(WpilogWriterOfResults, WritesNoMoreBytesThanNumbersNeed) {
  std::string bytes;
  const TakeText take = [&](std::string_view piece) { bytes += piece; };
  logs::WpilogWriter file(take, "");
  const std::uint32_t entry = file.start("/a", "boolean", 0);
  file.finish();
  bytes.clear();
  file.add(entry, 7, "\1");
  file.finish();
  EXPECT_EQ(bytes, std::string("\0\1\1\7\1", 5));
}

TEST(WpilogWriterOfResults, ManyEntriesAreToldApart) {
  std::string bytes;
  const TakeText take = [&](std::string_view piece) { bytes += piece; };
  logs::WpilogWriter file(take, "");
  std::vector<std::uint32_t> entries;
  for (int i = 0; i < 300; ++i) entries.push_back(file.start("/e" + std::to_string(i), "int64", 0));
  for (std::size_t i = 0; i < entries.size(); ++i)
    file.add(entries[i], 1, bytes_of_number(static_cast<std::int64_t>(i)));
  file.finish();
  const LogContent content = read_log(bytes);
  ASSERT_EQ(content.lines.size(), 300);
  EXPECT_EQ(content.lines[299], "1 /e299: value=299");
}

}  // namespace
}  // namespace trundle::test
