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

std::string doubles(std::initializer_list<double> values) {
  std::string bytes;
  for (const double value : values) bytes += bytes_of_number(value);
  return bytes;
}

TEST(Wpilog, HoldsValuesOfEveryTypeOfItsOwn) {
  for (const bool longest : {false, true}) {
    WpilogWriter log("extra header", longest);
    log.time_us = 1'234'567;
    log.record(log.start("a", "boolean"), "\1");
    log.record(log.start("b", "int64"), bytes_of_number(std::int64_t{-5'000'000'000'000'000'001}));
    log.record(log.start("c", "float"), bytes_of_number(1.5F));
    log.record(log.start("d", "double"), doubles({-2.25}));
    log.record(log.start("e", "string"), "words of it");
    log.record(log.start("f", "json"), "{}");
    log.time_us = (std::uint64_t{1} << 52) - 1;  // 142 years
    log.record(log.start("g", "boolean[]"), std::string("\0\1", 2));
    log.record(log.start("h", "int64[]"),
               bytes_of_number(std::int64_t{7}) + bytes_of_number(std::int64_t{-7}));
    log.record(log.start("i", "float[]"), bytes_of_number(0.5F));
    log.record(log.start("j", "double[]"), "");
    log.record(log.start("k", "string[]"),
               bytes_of_number(std::uint32_t{2}) + with_length("left") + with_length(""));
    log.record(log.start("l", "raw"), "abc");
    const LogContent content = read_log(log.bytes());
    EXPECT_FALSE(content.cut);
    EXPECT_THAT(
        content.lines,
        ElementsAre("1234567 a: value=1", "1234567 b: value=-5000000000000000001", "1234567 c: value=1.5",
                    "1234567 d: value=-2.25", "1234567 e: value='words of it'", "1234567 f: value='{}'",
                    "4503599627370495 g: value[0]=0 value[1]=1", "4503599627370495 h: value[0]=7 value[1]=-7",
                    "4503599627370495 i: value[0]=0.5", "4503599627370495 j: ",
                    "4503599627370495 k: value[0]='left' value[1]=''", "4503599627370495 l: ?"));
  }
}

TEST(Wpilog, LaysStructuresOutByTheirSchemas) {
  WpilogWriter log;
  const std::uint32_t pose = log.start("NT:/pose", "struct:Pose2d");
  const std::uint32_t states = log.start("states", "struct:State[]");
  log.record(log.start("NT:/.schema/struct:Pose2d", "structschema"),
             " Translation2d translation ; Rotation2d rotation;; ");
  log.record(pose, doubles({1, 2, 3}));  // its parts are not known yet
  log.record(log.start("NT:/.schema/struct:Translation2d", "structschema"), "double x;double y");
  log.record(log.start("NT:/.schema/struct:Rotation2d", "structschema"), "double value");
  log.record(log.start("NT:/.schema/struct:State", "structschema"),
             "enum {idle = 0, busy=1,} int8 mode; float32 speed [2]; char name[4]");
  log.record(pose, doubles({1, 2, 3}));
  log.record(states, std::string("\xff", 1) + bytes_of_number(1.0F) + bytes_of_number(2.0F) + "abcd" + '\2' +
                         bytes_of_number(3.0F) + bytes_of_number(4.0F) + padded("e", 4));
  const LogContent content = read_log(log.bytes());
  ASSERT_THAT(content.lines, SizeIs(7));
  EXPECT_EQ(content.lines[1], "0 NT:/pose: ?");
  EXPECT_EQ(content.lines[5], "0 NT:/pose: translation.x=1 translation.y=2 rotation.value=3");
  EXPECT_EQ(content.lines[6],
            "0 states: value[0].mode=-1 value[0].speed[0]=1 value[0].speed[1]=2 value[0].name='abcd' "
            "value[1].mode=2 value[1].speed[0]=3 value[1].speed[1]=4 value[1].name='e'");
}

/// The examples of the specification, and what a bit-field of each is.
TEST(Wpilog, PacksBitFieldsAsTheSpecificationSays) {
  struct Example {
    std::string schema, bytes, fields;
  };
  const std::vector<Example> examples = {
      {"int8 a:4; int16 b:4;", "\x0f\x03" + std::string(1, '\0'), "a=-1 b=3"},
      {"int16 a:4;uint16 b:5;bool c:1;int16 d:7;", std::string("\x52\x03\x41\x00", 4), "a=2 b=21 c=1 d=-63"},
      {"uint8 a:4;int8 b:2;bool c:1;int16 d:1;", std::string("\x55\x01\x00", 3), "a=5 b=1 c=1 d=-1"},
      {"bool a:1;bool b:1;int8 c:2;", "\x0a", "a=0 b=1 c=-2"},
      {"bool a:1;bool b:1;int16 c:2;", std::string("\x02\x01\x00", 3), "a=0 b=1 c=1"},
      {"uint32 a:20; uint32 b:12; uint32 c:1; double d",
       bytes_of_number(0x801'00001U) + bytes_of_number(1U) + doubles({0.5}), "a=1 b=2049 c=1 d=0.5"},
  };
  for (const Example& example : examples) {
    WpilogWriter log;
    log.record(log.start("/.schema/struct:Bits", "structschema"), example.schema);
    log.record(log.start("bits", "struct:Bits"), example.bytes);
    EXPECT_EQ(read_log(log.bytes()).lines.back(), "0 bits: " + example.fields) << example.schema;
  }
}

TEST(Wpilog, RefusesSchemasThatAreNone) {
  for (const char* const schema :
       {"double", "Bits inner", "Other inner", "int8 a:9", "double a:2", "bool a:2", "int8 a[0]", "int8 a[x]",
        "int8 a[4", "int8 a[99999999999]", "int8 a b"}) {
    WpilogWriter log;
    log.record(log.start("/.schema/struct:Bits", "structschema"), schema);
    log.record(log.start("bits", "struct:Bits"), "0123456789abcdef");
    EXPECT_EQ(read_log(log.bytes()).lines.back(), "0 bits: ?") << schema;
  }
}

TEST(Wpilog, AnEntryLastsFromStartToFinish) {
  WpilogWriter log;
  const std::uint32_t entry = log.start("speed", "double", "first");
  log.record(entry, doubles({1}));
  log.set_metadata(entry, "second");
  log.finish(entry);
  log.record(entry, doubles({2}));  // of nothing
  log.start_as(entry, "count", "int64");
  log.record(entry, bytes_of_number(std::int64_t{3}));
  log.start_as(99, "speed", "double", "third");
  log.record(99, doubles({4}));
  log.record(1000, doubles({5}));  // never started
  const LogFile file(log.bytes());
  const std::unique_ptr<Log> opened = open_log(file.path());
  EXPECT_EQ(opened->format(), "WPILOG");
  EXPECT_THAT(content_of(*opened).lines,
              ElementsAre("0 speed: value=1", "0 count: value=3", "0 speed: value=4"));
  ASSERT_THAT(opened->channels(), SizeIs(2));
  EXPECT_EQ(opened->channels()[0]->metadata, "second");
}

TEST(Wpilog, EveryCutIsToldAndWhatIsBeforeItIsRead) {
  WpilogWriter log("extra");
  const std::uint32_t entry = log.start("speed", "double[]");
  for (int row = 0; row < 3; ++row) log.record(entry, doubles({1.0 * row, 2.0}));
  const std::string whole = log.bytes();
  const std::size_t lines = read_log(whole).lines.size();
  ASSERT_EQ(lines, 3U);
  std::size_t silent = 0;
  for (std::size_t size = 17; size < whole.size(); ++size) {
    const LogContent content = read_log(whole.substr(0, size));
    EXPECT_LE(content.lines.size(), lines);
    for (std::size_t row = 0; row < content.lines.size(); ++row)
      EXPECT_EQ(content.lines[row], fmt::format("0 speed: value[0]={} value[1]=2", row));
    silent += content.cut ? 0 : 1;  // exactly behind a record the file is whole
  }
  EXPECT_EQ(silent, 4U);  // behind the head, the start and two rows
  EXPECT_LT(peak_memory_mb(), kMostMemory_mb);
  for (std::size_t size = 6; size < 17; ++size) EXPECT_THROW(read_log(whole.substr(0, size)), InputError);
}

TEST(Wpilog, ALengthBeyondTheLimitIsACut) {
  WpilogWriter log;
  log.record(log.start("text", "string"), std::string(100, 'x'));
  const LogContent content = read_log(log.bytes(), {.largest_message = 99});
  EXPECT_THAT(content.lines, IsEmpty());
  ASSERT_TRUE(content.cut);
  EXPECT_EQ(content.cut->reason, "a record of 100 bytes is larger than any");
}

TEST(Wpilog, EntriesAndSchemasWithoutEndAreRefused) {
  WpilogWriter log;
  for (int i = 0; i < 100; ++i)
    (void)log.start(fmt::format("entry {} ", i) + std::string(1000, 'x'), "double");
  const LogContent content = read_log(log.bytes(), {.all_definitions = 50'000});
  ASSERT_TRUE(content.cut);
  EXPECT_EQ(content.cut->reason, "it starts more entries than any");
  WpilogWriter schemas;
  for (int i = 0; i < 100; ++i)
    schemas.record(schemas.start(fmt::format("/.schema/struct:S{}", i), "structschema"),
                   "double x;" + std::string(1000, ' '));
  schemas.record(schemas.start("last", "struct:S99"), doubles({1}));
  EXPECT_EQ(read_log(schemas.bytes()).lines.back(), "0 last: x=1");
  EXPECT_EQ(read_log(schemas.bytes(), {.all_definitions = 50'000}).lines.back(), "0 last: ?");
}

TEST(Wpilog, RefusesAnotherVersion) {
  EXPECT_THROW(read_log(WpilogWriter("", false, 0x0200).bytes()), InputError);
}

/// Numbers of a program of its own (Python's struct) that went through the files.
TEST(Wpilog, ReadsTheGenuineLogsToTheirEnd) {
  TRUNDLE_NEEDS_REAL_DATA("logs");
  const auto gyro = open_log(real_data() / "logs" / "stuypulse_gyro_odometer.wpilog");
  const LogContent content = content_of(*gyro);
  EXPECT_FALSE(content.cut);
  EXPECT_THAT(gyro->channels(), SizeIs(86));
  std::size_t of_gyro = 0;
  for (const std::string& line : content.lines)
    of_gyro += line.find("AnalogGyro[0]/Value: ") != std::string::npos;
  EXPECT_EQ(of_gyro, 1572U);
  const auto swerve = open_log(real_data() / "logs" / "swerve_idle.wpilog");
  EXPECT_FALSE(content_of(*swerve).cut);
  EXPECT_THAT(swerve->channels(), SizeIs(214));
}

}  // namespace
}  // namespace trundle::test
