// Recordings of columns in memory are those of files with the same rows.
#include "trundle/recording/columns.hpp"

#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

namespace trundle::recording {
namespace {

using ::testing::HasSubstr;

std::vector<StreamColumns> streams() {
  return {{.stream = "wheels",
           .numbers = {{"time_s", {0.0, 0.1, 0.1, 0.3}},
                       {"left_ticks", {0.0, 5.0, 6.0, 9.0}},
                       {"right_ticks", {0.0, 5.0, kNotMeasured, 9.0}}}},
          {.stream = "gyro", .numbers = {{"yaw_rate_rad_s", {0.5, 0.25}}, {"time_s", {0.0, 0.3}}}},
          {.stream = "sightings",
           .numbers = {{"time_s", {0.1, 0.2}}, {"range_m", {1.0, 2.0}}, {"bearing_rad", {0.0, 0.5}}},
           .landmarks = {"a", ""}}};
}

std::filesystem::path written() {
  const auto folder = std::filesystem::path(testing::TempDir()) / "columns_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "wheels.csv") << "time_s,left_ticks,right_ticks\n0,0,0\n0.1,5,5\n0.1,6,\n0.3,9,9\n";
  std::ofstream(folder / "gyro.csv") << "time_s,yaw_rate_rad_s\n0,0.5\n0.3,0.25\n";
  std::ofstream(folder / "sightings.csv") << "time_s,landmark,range_m,bearing_rad\n0.1,a,1,0\n0.2,,2,0.5\n";
  return folder;
}

TEST(Columns, AreReadAsTheirFiles) {
  const Recording mine = recording_of("mine", streams()), theirs = read_recording(written());
  EXPECT_EQ(mine.name, "mine");
  EXPECT_EQ(mine.wheels.time_s, theirs.wheels.time_s);
  ASSERT_EQ(mine.wheels.series.size(), 2U);
  EXPECT_EQ(mine.wheels.series[0].wheel, "left");
  EXPECT_EQ(mine.wheels.series[0].value, theirs.wheels.series[0].value);
  EXPECT_EQ(mine.gyro.yaw_rate_rad_s, theirs.gyro.yaw_rate_rad_s);
  ASSERT_EQ(mine.sightings.size(), 2U);
  EXPECT_EQ(mine.sightings[0].landmark, "a");
  EXPECT_EQ(mine.sightings[1].bearing_rad, 0.5);
  ASSERT_EQ(mine.findings.size(), theirs.findings.size());
  for (std::size_t i = 0; i < mine.findings.size(); ++i) {
    EXPECT_EQ(mine.findings[i].code, theirs.findings[i].code);
    EXPECT_EQ(mine.findings[i].count, theirs.findings[i].count);
  }
  EXPECT_EQ(mine.findings.front().place, "wheels:3");
}

TEST(Columns, ProvenanceTellsOtherNumbers) {
  std::vector<StreamColumns> other = streams();
  other[1].numbers[0].second[0] = 0.75;
  const Recording a = recording_of("a", streams()), b = recording_of("b", other);
  ASSERT_EQ(a.inputs.size(), 3U);
  EXPECT_EQ(a.inputs[0].sha256, b.inputs[0].sha256);
  EXPECT_NE(a.inputs[1].sha256, b.inputs[1].sha256);
}

TEST(Columns, SayWhatIsWrong) {
  const auto message_of = [](std::vector<StreamColumns> columns) -> std::string {
    try {
      (void)recording_of("mine", std::move(columns));
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  };
  EXPECT_THAT(message_of({}), HasSubstr("mine: holds no samples"));
  EXPECT_THAT(message_of({{"wheel", {}}}), HasSubstr("wheel: is no stream of a recording"));
  EXPECT_THAT(message_of({{"gyro", {{"time_s", {0.0}}}}}), HasSubstr("gyro: has no column 'yaw_rate_rad_s'"));
  EXPECT_THAT(message_of({{"gyro", {{"yaw_rate_rad_s", {0.0}}}}}), HasSubstr("gyro: has no column 'time_s'"));
  EXPECT_THAT(message_of({{"gyro", {{"time_s", {0.0}}, {"yaw_rate_rad_s", {}}}}}), HasSubstr("has 0 rows"));
  EXPECT_THAT(message_of({{"wheels", {{"time_s", {0.0}}}}}), HasSubstr("has no column of a wheel"));
  EXPECT_THAT(message_of({{"landmarks", {{"x_m", {0.0}}, {"y_m", {0.0}}}}}),
              HasSubstr("has no column 'landmark'"));
}

TEST(Columns, AreNamedAsInFiles) {
  EXPECT_TRUE(has_column("wheels", "front_left_rad_s"));
  EXPECT_TRUE(has_column("wheels", "time_s"));
  EXPECT_FALSE(has_column("wheels", "battery"));
  EXPECT_TRUE(has_column("reference", "heading_rad"));
  EXPECT_FALSE(has_column("landmarks", "time_s"));
  const Recording mine = recording_of("mine", streams());
  EXPECT_EQ(columns_of(mine.wheels)[1].first, "right_ticks");
}

}  // namespace
}  // namespace trundle::recording
