#include "trundle/logs/survey.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "logs/packed_writers.hpp"
#include "logs/read_log.hpp"
#include "real_data.hpp"

namespace trundle::test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

LogSummary survey_of(std::string_view bytes, const SurveyOptions& options = {}) {
  const LogFile file(bytes);
  return survey(*open_log(file.path()), options);
}

TEST(Survey, TellsRateGapsAndWhereTheLogIsCut) {
  WpilogWriter log;
  const std::uint32_t fast = log.start("fast", "double"), once = log.start("once", "raw");
  log.start("never", "double");
  for (int row = 0; row < 500; ++row) {
    log.time_us = 1'000'000 + 20'000 * static_cast<std::uint64_t>(row) + (row >= 300 ? 600'000 : 0);
    log.record(fast, bytes_of_number(1.0 * row));
  }
  log.record(once, "abc");
  const std::string bytes = log.bytes() + "\x10";
  const LogSummary summary = survey_of(bytes);
  EXPECT_EQ(summary.format, "WPILOG");
  EXPECT_TRUE(summary.is_written_on_change);
  ASSERT_TRUE(summary.cut);
  EXPECT_EQ(summary.cut->byte, bytes.size() - 1);
  ASSERT_THAT(summary.topics, SizeIs(3));
  const TopicSummary& topic = summary.topics[0];
  EXPECT_EQ(topic.topic, "fast");
  EXPECT_EQ(topic.messages, 500U);
  EXPECT_NEAR(topic.rate_hz, 50.0, 1e-9);
  EXPECT_EQ(topic.gaps, 1U);
  EXPECT_DOUBLE_EQ(topic.longest_step_s, 0.62);
  EXPECT_EQ(topic.start_ns, 1'000'000'000);
  EXPECT_EQ(topic.unreadable, "");
  EXPECT_THAT(topic.paths, ElementsAre("value"));
  EXPECT_THAT(topic.fields, IsEmpty());
  EXPECT_EQ(summary.topics[1].messages, 0U);
  EXPECT_EQ(summary.topics[2].rate_hz, 0.0);
  EXPECT_NE(summary.topics[2].unreadable, "");
}

TEST(Survey, TellsWhatFieldsWere) {
  WpilogWriter log;
  const std::uint32_t count = log.start("count", "double[]"), text = log.start("text", "string");
  for (const double value : {1.0, 3.0, 3.0, 2.0})
    log.record(count, bytes_of_number(value) + bytes_of_number(0.0));
  log.record(text, "");
  log.record(text, "words");
  const LogSummary summary = survey_of(log.bytes(), {.fields = true});
  ASSERT_THAT(summary.topics[0].fields, SizeIs(2));
  const FieldSummary& field = summary.topics[0].fields[0];
  EXPECT_EQ(field.path, "value[0]");
  EXPECT_EQ(field.values, 4U);
  EXPECT_EQ(field.changes, 2U);
  EXPECT_EQ(field.falls, 1U);
  EXPECT_EQ(field.first, 1.0);
  EXPECT_EQ(field.last, 2.0);
  EXPECT_EQ(field.least, 1.0);
  EXPECT_EQ(field.most, 3.0);
  EXPECT_EQ(field.travel, 3.0);
  EXPECT_TRUE(summary.topics[1].fields[0].is_text);
  EXPECT_EQ(summary.topics[1].fields[0].text, "words");
}

TEST(Survey, KeepsNoMoreFieldsThanItMay) {
  WpilogWriter log;
  const std::uint32_t entry = log.start("array", "double[]");
  log.record(entry, std::string(8 * 1000, '\0'));
  EXPECT_THAT(survey_of(log.bytes(), {.fields = true, .most_fields = 10}).topics[0].fields, SizeIs(10));
  EXPECT_THAT(survey_of(log.bytes(), {.fields = true, .largest_message = 7999}).topics[0].fields, IsEmpty());
}

TEST(Survey, NamesJointsAndComparesStampsWithTheClockOfTheLog) {
  TRUNDLE_NEEDS_REAL_DATA("logs/gsid_square.bag");
  const LogSummary summary = survey(*open_log(real_data() / "logs" / "gsid_square.bag"), {.fields = true});
  const auto joints = std::ranges::find(summary.topics, "sensor_msgs/JointState", &TopicSummary::type);
  ASSERT_NE(joints, summary.topics.end());
  EXPECT_TRUE(joints->stamp_lag);
  EXPECT_TRUE(std::ranges::any_of(joints->fields, [](const FieldSummary& field) {
    return field.path.starts_with("position[name=") && field.travel > 0.0;
  }));
}

TEST(Survey, SaysOfATopicThatItsMessagesAreParameterLists) {
  WrittenLog written{.channels = {{"/x", "a/msg/X", "int32 x\n"}}, .messages = {}};
  for (int i = 0; i < 3; ++i)
    written.messages.push_back({0, i, CdrBytes(false, 10).put(std::int32_t{i}).bytes()});
  const LogFile file(mcap_of(written, {.schema = "ros2msg", .encoding = "cdr"}));
  const LogSummary summary = survey(*open_log(file.path()), {.fields = true});
  ASSERT_EQ(summary.topics.size(), 1U);
  EXPECT_EQ(summary.topics[0].messages, 3U);
  EXPECT_EQ(summary.topics[0].unreadable,
            "they are parameter lists (PL_CDR2, encapsulation 0x000b), which are not read");
}

}  // namespace
}  // namespace trundle::test
