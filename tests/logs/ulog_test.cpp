#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "logs/packed_writers.hpp"
#include "logs/read_log.hpp"
#include "real_data.hpp"

namespace trundle::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

std::string stamp_us(std::uint64_t time_us) {
  return bytes_of_number(time_us);
}

UlogWriter rate_log() {
  UlogWriter log;
  log.define("rate:uint64_t timestamp;float z;uint8_t[4] _padding0;");
  log.subscribe(0, 3, "rate");
  return log;
}
std::string rate_row(std::uint64_t time_us, float z) {
  return stamp_us(time_us) + bytes_of_number(z);  // padding at the end is not written
}

TEST(Ulog, HoldsFieldsOfEveryType) {
  UlogWriter log(17);
  log.flags(0);
  log.define(
      "all:uint64_t timestamp;int8_t a;uint8_t b;int16_t c;uint16_t d;int32_t e;uint32_t f;int64_t g;"
      "uint64_t h;float i;double j;bool k;char l;char[6] m;float[2] n;");
  log.message('I',
              "\x0b"
              "char[2] keyab");
  log.subscribe(0, 9, "all");
  log.data(9, stamp_us(5) + "\xfe\xfe" + bytes_of_number(std::int16_t{-300}) +
                  bytes_of_number(std::uint16_t{300}) + bytes_of_number(std::int32_t{-70000}) +
                  bytes_of_number(std::uint32_t{70000}) + bytes_of_number(std::int64_t{-1}) +
                  bytes_of_number(std::uint64_t{1} << 63) + bytes_of_number(0.5F) + bytes_of_number(0.1) +
                  '\1' + 'x' + padded("text", 6) + bytes_of_number(1.0F) + bytes_of_number(2.0F));
  EXPECT_THAT(read_log(log.bytes()).lines,
              ElementsAre("5 all: timestamp=5 a=-2 b=254 c=-300 d=300 e=-70000 f=70000 g=-1 "
                          "h=9223372036854775808 i=0.5 j=0.1 k=1 l='x' m='text' n[0]=1 n[1]=2"));
}

TEST(Ulog, NestsTypesWithTheirPadding) {
  UlogWriter log;
  log.define("outer:uint64_t timestamp;inner[2] parts;inner last;uint8_t[2] _padding0;");
  log.define("inner:uint8_t id;uint8_t[3] _padding0;float x;");
  log.subscribe(0, 1, "outer");
  const auto part = [](char id, float x) {
    return std::string(1, id) + std::string(3, '?') + bytes_of_number(x);
  };
  log.data(1, stamp_us(8) + part(1, 0.5F) + part(2, 1.5F) + part(3, 2.5F));
  EXPECT_THAT(read_log(log.bytes()).lines,
              ElementsAre("8 outer: timestamp=8 parts[0].id=1 parts[0].x=0.5 parts[1].id=2 parts[1].x=1.5 "
                          "last.id=3 last.x=2.5"));
}

TEST(Ulog, InstancesAreTopicsOfTheirOwn) {
  UlogWriter log = rate_log();
  log.subscribe(1, 4, "rate");
  log.subscribe(0, 5, "undefined");
  log.data(3, rate_row(1, 1));
  log.data(4, rate_row(2, 2));
  log.data(5, "anything");
  log.data(77, rate_row(3, 3));  // of no subscription
  log.message('R', bytes_of_number(std::uint16_t{4}));
  log.data(4, rate_row(4, 4));
  EXPECT_THAT(read_log(log.bytes()).lines,
              ElementsAre("1 rate: timestamp=1 z=1", "2 rate[1]: timestamp=2 z=2", "2 undefined: ?"));
}

TEST(Ulog, GoesOnWhereDataWereAppended) {
  UlogWriter log;
  const std::size_t place = log.flags(1);
  log.define("rate:uint64_t timestamp;float z;");
  log.subscribe(0, 3, "rate");
  log.data(3, rate_row(1, 1));
  log.bytes() += std::string(
      "\x40\x00"
      "D\x03\x00",
      5);  // a message that a crash broke off
  log.bytes().replace(place, 8, bytes_of_number(std::uint64_t{log.bytes().size()}));
  log.data(3, rate_row(2, 2));
  const LogContent content = read_log(log.bytes());
  EXPECT_THAT(content.lines, ElementsAre("1 rate: timestamp=1 z=1", "2 rate: timestamp=2 z=2"));
  EXPECT_FALSE(content.cut);
}

TEST(Ulog, TakesUpBehindDamageAtTheNextSync) {
  UlogWriter log = rate_log();
  log.data(3, rate_row(1, 1));
  log.bytes() += std::string(100'000, '\0');
  log.sync();
  log.data(3, rate_row(2, 2));
  log.bytes() += std::string("\1\0\0damage", 9);
  log.sync();
  log.data(3, rate_row(3, 3));
  const LogContent content = read_log(log.bytes());
  EXPECT_THAT(content.lines, SizeIs(3));
  EXPECT_FALSE(content.cut);
  ASSERT_THAT(content.losses, SizeIs(2));
  EXPECT_EQ(content.losses[0].bytes, 100'000U + 3U + 8U);
  EXPECT_EQ(content.losses[1].bytes, 9U + 3U + 8U);
}

TEST(Ulog, DamageWithoutSyncIsTheEnd) {
  UlogWriter log = rate_log();
  log.data(3, rate_row(1, 1));
  log.bytes() += std::string(1000, '\0');
  const LogContent content = read_log(log.bytes());
  EXPECT_THAT(content.lines, SizeIs(1));
  ASSERT_TRUE(content.cut);
  EXPECT_EQ(content.cut->reason, "the last 1000 bytes hold no whole message");
  EXPECT_EQ(content.cut->byte, log.bytes().size() - 1000);
}

TEST(Ulog, EveryCutIsToldAndWhatIsBeforeItIsRead) {
  UlogWriter log = rate_log();
  const std::size_t head = log.bytes().size();
  for (std::uint64_t row = 1; row < 4; ++row) log.data(3, rate_row(row, 1));
  const std::size_t row_size = (log.bytes().size() - head) / 3;
  const std::string whole = log.bytes();
  std::size_t silent = 0;
  for (std::size_t size = 16; size < whole.size(); ++size) {
    const LogContent content = read_log(whole.substr(0, size));
    EXPECT_EQ(content.lines.size(), size < head ? 0 : (size - head) / row_size) << size;
    silent += content.cut ? 0 : 1;
  }
  EXPECT_EQ(silent, 2U + 3U);  // behind the head, the definition, the subscription and two rows
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
  for (std::size_t size = 7; size < 16; ++size) EXPECT_THROW(read_log(whole.substr(0, size)), InputError);
}

TEST(Ulog, RefusesFlagsItDoesNotKnow) {
  UlogWriter log;
  log.flags(2);
  EXPECT_THROW(read_log(log.bytes()), InputError);
}

TEST(Ulog, DefinitionsWithoutEndAreRefused) {
  for (const char* const text :
       {"rate:rate inner;", "rate:other inner;", "rate:float[0] x;", "rate:float[-1] x;",
        "rate:float[9999999999] x;", "rate:float;", "rate:float[ x;"}) {
    UlogWriter log;
    log.define(text);
    log.subscribe(0, 3, "rate");
    log.data(3, rate_row(1, 1));
    EXPECT_THAT(read_log(log.bytes()).lines, ElementsAre("0 rate: ?")) << text;
  }
  UlogWriter log;
  for (int i = 0; i < 300; ++i) log.define(fmt::format("m{}:", i) + std::string(60'000, ';'));
  const LogContent content = read_log(log.bytes());
  ASSERT_TRUE(content.cut);
  EXPECT_EQ(content.cut->reason, "it defines more messages than any");
}

/// Numbers of a program of its own (Python's struct) that went through the file.
TEST(Ulog, ReadsTheGenuineLogToItsEnd) {
  TRUNDLE_NEEDS_REAL_DATA("logs");
  const auto log = open_log(real_data() / "logs" / "px4_small.ulg");
  std::map<std::string, std::size_t> counts;
  std::size_t cut_off = 0, all = 0;
  while (const std::optional<Message> message = log->next()) {
    ++counts[message->channel->topic];
    ++all;
    cut_off += fields_of(*message).ends_with("...") ? 1 : 0;
  }
  EXPECT_EQ(all, 14604U);
  EXPECT_EQ(cut_off, 0U);
  EXPECT_EQ(counts["vehicle_angular_velocity"], 1812U);
  EXPECT_EQ(counts["sensor_gyro[2]"], 6U);
  EXPECT_FALSE(log->cut());
  EXPECT_THAT(log->losses(), IsEmpty());
}

}  // namespace
}  // namespace trundle::test
