#include <gmock/gmock.h>

#include "trundle/recording/finding.hpp"

namespace trundle::recording {
namespace {

using testing::HasSubstr;
using testing::Not;

/// One of every kind.
const std::vector<Payload> kPayloads = {std::monostate(),
                                        payload::Further{},
                                        payload::Amount{16.0},
                                        payload::Times{4.0},
                                        payload::Share{0.25},
                                        payload::Range{-1.0, 2.0},
                                        payload::Excess{.farthest = 9.0, .limit = 3.0, .all = 7},
                                        payload::Spans{0.0, 1.0, 2.0, 3.0},
                                        payload::Names{{"left", "right"}},
                                        payload::Disorder{true, true},
                                        payload::StampStep{1e3, "ms"},
                                        payload::Standstill{3.0, 0.5},
                                        payload::SteadyRate{3.0, 0.1, 0.01, 0.002},
                                        payload::ClockOffset{.off_s = 0.01, .file = "robot.toml"},
                                        payload::LengthRatio{1e3, "millimetres", "mm"},
                                        payload::Stretch{1.0, 2.0, 7},
                                        payload::Offset{0.05, 0.01, 1.5}};

Finding of(FindingCode code, const Payload& payload) {
  return {
      .code = code, .place = "wheels.csv:3", .count = 2, .subjects = {"left", "right"}, .payload = payload};
}

/// Whether the code comes with such a payload: else its name is all that can be said.
bool has_sentence(const Finding& finding) {
  return describe(finding) != name_of(finding.code);
}

TEST(Describe, every_code_has_a_sentence) {
  ASSERT_EQ(kPayloads.size(), std::variant_size_v<Payload>);
  for (std::size_t i = 0; i < kFindingCodes; ++i) {
    const auto code = static_cast<FindingCode>(i);
    std::size_t sentences = 0;
    for (const Payload& payload : kPayloads)
      sentences += std::holds_alternative<payload::Further>(payload) ? 0 : has_sentence(of(code, payload));
    EXPECT_GT(sentences, 0U) << name_of(code);
  }
}

TEST(Describe, every_placeholder_is_filled) {
  for (std::size_t i = 0; i < kFindingCodes; ++i)
    for (const Payload& payload : kPayloads) {
      const std::string sentence = describe(of(static_cast<FindingCode>(i), payload));
      EXPECT_FALSE(sentence.empty()) << i;
      EXPECT_THAT(sentence, Not(testing::ContainsRegex("[{}]"))) << i;
    }
}

TEST(Describe, every_payload_is_of_some_code) {
  for (const Payload& payload : kPayloads) {
    bool is_used = false;
    for (std::size_t i = 0; i < kFindingCodes; ++i)
      is_used = is_used || has_sentence(of(static_cast<FindingCode>(i), payload));
    EXPECT_TRUE(is_used) << payload.index();
  }
}

TEST(Describe, names_are_joined_and_counts_agree) {
  Finding finding{.code = FindingCode::ticks_per_revolution, .subjects = {"left", "right"}};
  EXPECT_THAT(describe(finding), HasSubstr("'left' and 'right' have no ticks_per_revolution"));
  finding.subjects.pop_back();
  EXPECT_THAT(describe(finding), HasSubstr("'left' has no ticks_per_revolution"));
  finding.code = FindingCode::duplicate;
  EXPECT_THAT(describe(finding), HasSubstr("1 row with"));
  finding.count = 2;
  EXPECT_THAT(describe(finding), HasSubstr("2 rows with"));
}

TEST(Describe, an_offset_that_stands_in_two_files_is_brought_into_one) {
  const Finding finding{.code = FindingCode::time_offset,
                        .payload = payload::ClockOffset{.off_s = -0.02,
                                                        .by_robot_s = 0.01,
                                                        .by_map_s = 0.03,
                                                        .file = "robot.toml",
                                                        .map = "recording.toml"}};
  EXPECT_THAT(describe(finding), HasSubstr("20.0 ms too late"));
  EXPECT_THAT(describe(finding), HasSubstr("in both recording.toml (0.0300) and robot.toml (0.0100)"));
  EXPECT_THAT(describe(finding), HasSubstr("write time_offset_s = 0.0200 under [gyro] in robot.toml"));
}

}  // namespace
}  // namespace trundle::recording
