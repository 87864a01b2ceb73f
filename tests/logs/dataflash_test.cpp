#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "logs/packed_writers.hpp"
#include "logs/read_log.hpp"
#include "real_data.hpp"

namespace trundle::test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

constexpr int kFmt = 128;

void describe_formats(DataFlashWriter& log) {
  log.format(kFmt, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
}

std::string seconds(std::uint64_t time_s) {
  return bytes_of_number(time_s * 1'000'000);
}

/// A log of wheel encoders: FMT twice, then rows.
DataFlashWriter encoder_log() {
  DataFlashWriter log;
  describe_formats(log);
  log.format(10, 3 + 8 + 4 + 4, "WENC", "Qff", "TimeUS,Dist0,Dist1");
  return log;
}
std::string encoder_row(std::uint64_t time_s, float left, float right) {
  return seconds(time_s) + bytes_of_number(left) + bytes_of_number(right);
}

TEST(DataFlash, HoldsFieldsOfEveryCharacter) {
  DataFlashWriter log;
  describe_formats(log);
  log.format(1, 3 + 1 + 1 + 2 + 2 + 4 + 4 + 4 + 8 + 8 + 8, "INTS", "bBhHiIfdqQ", "a,b,c,d,e,f,g,h,i,j");
  log.format(2, 3 + 64 + 4 + 16 + 64, "TEXT", "anNZ", "array,n,N,Z");
  log.format(3, 3 + 2 + 2 + 4 + 4 + 4 + 1 + 4 * 2, "SCAL", "cCeELMgggg", "c,C,e,E,Lat,M,half,tiny,most,none");
  log.message(1, "\xff\xff" + bytes_of_number(std::int16_t{-300}) + bytes_of_number(std::uint16_t{65535}) +
                     bytes_of_number(std::int32_t{-70000}) + bytes_of_number(std::uint32_t{4'000'000'000}) +
                     bytes_of_number(1.5F) + bytes_of_number(0.1) +
                     bytes_of_number(std::int64_t{-9'007'199'254'740'993}) +
                     bytes_of_number(std::uint64_t{18'446'744'073'709'551'615U}));
  std::string array;
  for (std::int16_t i = 0; i < 32; ++i) array += bytes_of_number(static_cast<std::int16_t>(-i));
  log.message(2, array + "abcd" + padded("name", 16) + std::string(64, 'z'));
  log.message(3, bytes_of_number(std::int16_t{-12345}) + bytes_of_number(std::uint16_t{12345}) +
                     bytes_of_number(std::int32_t{-1234567}) + bytes_of_number(std::uint32_t{1234567}) +
                     bytes_of_number(std::int32_t{473000000}) + '\7' +
                     // -1.5, the least above 0, the largest, and no number
                     bytes_of_number(std::uint16_t{0xbe00}) + bytes_of_number(std::uint16_t{1}) +
                     bytes_of_number(std::uint16_t{0x7bff}) + bytes_of_number(std::uint16_t{0x7e00}));
  const LogContent content = read_log(log.bytes());
  EXPECT_FALSE(content.cut);
  ASSERT_THAT(content.lines, SizeIs(7));
  EXPECT_EQ(content.lines[4],
            "0 INTS: a=-1 b=255 c=-300 d=65535 e=-70000 f=4000000000 g=1.5 h=0.1 i=-9007199254740993 "
            "j=18446744073709551615");
  EXPECT_NE(content.lines[5].find("array[31]=-31 n='abcd' N='name' Z='" + std::string(64, 'z') + "'"),
            std::string::npos)
      << content.lines[5];
  EXPECT_EQ(content.lines[6],
            fmt::format("0 SCAL: c={} C={} e={} E={} Lat={} M=7 half=-1.5 tiny={} most=65504 none=nan",
                        -12345 * 0.01, 12345 * 0.01, -1234567 * 0.01, 1234567 * 0.01, 473000000 * 1e-7,
                        1.0 / (1 << 24)));
}

TEST(DataFlash, TimeIsThatOfTheLogsOwnClock) {
  DataFlashWriter log = encoder_log();
  log.format(11, 3 + 4 + 1, "OLD", "IB", "TimeMS,x");
  log.format(12, 3 + 4 + 2 + 4, "GPS", "IHI", "TimeMS,Week,T");
  log.format(13, 3 + 1, "BARE", "B", "x");
  log.message(10, encoder_row(5, 0, 0));
  log.message(13, "\1");
  log.message(11, bytes_of_number(std::uint32_t{6000}) + "\1");
  log.message(12, bytes_of_number(std::uint32_t{345'600'000}) + bytes_of_number(std::uint16_t{1800}) +
                      bytes_of_number(std::uint32_t{7000}));
  log.message(10, bytes_of_number(std::uint64_t{18'446'744'073'709'551'615U}) + std::string(8, '\0'));
  const LogContent content = read_log(log.bytes());
  std::vector<std::string> times;
  for (const std::string& line : content.lines) times.push_back(line.substr(0, line.find(':')));
  EXPECT_THAT(std::vector(times.end() - 5, times.end()),
              ElementsAre("5000000 WENC", "5000000 BARE", "6000000 OLD", "7000000 GPS", "7000000 WENC"));
}

TEST(DataFlash, UnitsTellInstancesApart) {
  DataFlashWriter log;
  describe_formats(log);
  log.format(20, 3 + 8 + 1 + 64, "UNIT", "QbZ", "TimeUS,Id,Label");
  log.format(21, 3 + 8 + 1 + 8, "MULT", "Qbd", "TimeUS,Id,Mult");
  log.format(22, 3 + 8 + 1 + 16 + 16, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds");
  log.format(23, 3 + 8 + 1 + 4 + 2, "IMU", "QBfc", "TimeUS,I,GyrZ,Tmp");
  log.message(20, seconds(0) + "s" + padded("s", 64));
  log.message(20, seconds(0) + "E" + padded("rad/s", 64));
  log.message(20, seconds(0) + "O" + padded("degC", 64));
  log.message(21, seconds(0) + "F" + bytes_of_number(1e-6));
  log.message(21, seconds(0) + "B" + bytes_of_number(1e-2));
  log.message(22, seconds(0) + std::string(1, 23) + padded("s#EO", 16) + padded("F--B", 16));
  const auto row = [&](int instance, float rate) {
    log.message(23, seconds(1) + std::string(1, static_cast<char>(instance)) + bytes_of_number(rate) +
                        bytes_of_number(std::int16_t{2500}));
  };
  row(0, 0.5F);
  row(2, 0.25F);
  const LogFile file(log.bytes());
  const std::unique_ptr<Log> opened = open_log(file.path());
  const LogContent content = content_of(*opened);
  EXPECT_THAT(content.lines, Contains("1000000 IMU[0]: TimeUS=1000000 I=0 GyrZ=0.5 Tmp=25"));
  EXPECT_THAT(content.lines, Contains("1000000 IMU[2]: TimeUS=1000000 I=2 GyrZ=0.25 Tmp=25"));
  const Channel& imu = *opened->channels().back();
  EXPECT_EQ(imu.topic, "IMU[2]");
  std::vector<std::string> units;
  for (const LayoutField& field : imu.layout->root().fields) units.push_back(field.unit);
  EXPECT_THAT(units, ElementsAre("1e-06 s", "", "rad/s", "degC"));
}

TEST(DataFlash, EverySyncLossIsToldAndWhatFollowsIsRead) {
  DataFlashWriter log = encoder_log();
  log.message(10, encoder_row(1, 1, 1));
  log.damage(std::string("\xa3\x95\x0a", 3) + "damaged");  // a head among the damage
  log.message(10, encoder_row(2, 2, 2));
  log.message(10, encoder_row(3, 3, 3));
  log.damage(std::string(300'000, '\xa3'));  // more than is looked through at once
  log.message(10, encoder_row(4, 4, 4));
  log.message(10, encoder_row(5, 5, 5));
  log.message(99, "no FMT says what this is");
  log.message(10, encoder_row(6, 6, 6));
  const LogContent content = read_log(log.bytes());
  EXPECT_FALSE(content.cut);
  std::vector<std::string> rows(content.lines.begin() + 2, content.lines.end());
  for (std::string& row : rows) row = row.substr(0, 1);
  // The head among the damage swallows no row; a row that no head follows may be damaged itself.
  EXPECT_THAT(rows, ElementsAre("1", "2", "4", "5", "6"));
  ASSERT_THAT(content.losses, SizeIs(3));
  EXPECT_EQ(content.losses[0].bytes, 3U + 7U);
  EXPECT_EQ(content.losses[1].bytes, 19U + 300'000U);
  EXPECT_EQ(content.losses[2].bytes, 3U + 24U);
}

TEST(DataFlash, ErasedMemoryAtTheEndIsNoLoss) {
  for (const char filler : {'\0', '\xff'}) {
    DataFlashWriter log = encoder_log();
    log.message(10, encoder_row(1, 1, 1));
    log.damage(std::string(100'000, filler));
    const LogContent content = read_log(log.bytes());
    EXPECT_THAT(content.lines, SizeIs(3));
    EXPECT_FALSE(content.cut);
    EXPECT_THAT(content.losses, IsEmpty());
  }
}

TEST(DataFlash, EveryCutIsToldAndWhatIsBeforeItIsRead) {
  DataFlashWriter log = encoder_log();
  for (std::uint64_t row = 1; row < 4; ++row) log.message(10, encoder_row(row, 1, 2));
  const std::string whole = log.bytes();
  std::size_t silent = 0;
  for (std::size_t size = 2; size < whole.size(); ++size) {
    const LogContent content = read_log(whole.substr(0, size));
    EXPECT_EQ(content.lines.size(), size < 89 ? 0 : size < 178 ? 1 : 2 + (size - 178) / 19) << size;
    silent += content.cut ? 0 : 1;
  }
  EXPECT_EQ(silent, 2U + 2U);  // behind each message the file is whole
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
}

TEST(DataFlash, AFormatThatContradictsItselfDescribesNothing) {
  DataFlashWriter log;
  describe_formats(log);
  log.format(10, 2, "SHRT", "B", "x");      // shorter than its own head
  log.format(11, 250, "LONG", "B", "x");    // than its fields are
  log.format(12, 3 + 1, "ODD", "?", "x");   // no such character
  log.format(13, 3 + 2, "BARE", "BB", "");  // no names
  log.message(13, "\1\2");
  EXPECT_EQ(read_log(log.bytes()).lines.back(), "0 BARE: field0=1 field1=2");
}

TEST(DataFlash, AnotherFormatOfATypeBeginsAnew) {
  DataFlashWriter log = encoder_log();
  log.message(10, encoder_row(1, 1, 1));
  log.format(10, 3 + 8 + 4 + 4, "WENC", "Qff", "TimeUS,Dist0,Dist1");  // the same
  log.message(10, encoder_row(2, 1, 1));
  log.format(10, 3 + 1, "NEW", "B", "x");
  log.message(10, "\1");
  const LogFile file(log.bytes());
  const auto opened = open_log(file.path());
  EXPECT_EQ(content_of(*opened).lines.back(), "2000000 NEW: x=1");
  EXPECT_THAT(opened->channels(), SizeIs(3));
}

/// Numbers of a program of its own (Python's struct) that went through the file.
TEST(DataFlash, ReadsTheGenuineLogToItsEnd) {
  TRUNDLE_NEEDS_REAL_DATA("logs");
  const auto log = open_log(real_data() / "logs" / "dataflash_imu_gps.bin");
  std::map<std::string, std::size_t> counts;
  while (const std::optional<Message> message = log->next()) ++counts[message->channel->topic];
  ASSERT_TRUE(log->cut());  // the last IMU is not whole
  EXPECT_EQ(counts["IMU"], 15051U);
  EXPECT_EQ(counts["IMU2"], 15051U);
  EXPECT_EQ(counts["GPS"], 1500U);
  EXPECT_EQ(counts["PARM"], 331U);
  EXPECT_EQ(counts["FMT"], 30U);
  EXPECT_THAT(log->losses(), IsEmpty());
}

}  // namespace
}  // namespace trundle::test
