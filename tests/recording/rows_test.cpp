// What is wrong with the rows of a log: found, counted, with the line of the first.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/recording/recording.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::IsEmpty;
using testing::SizeIs;

struct Log {
  std::vector<double> time_s;
  std::vector<double> value;
  std::vector<Finding> findings;
};

Log log_of(const std::string& rows) {
  const test::Folder folder;
  folder.write("wheels.csv", "time_s,left_ticks\n" + rows);
  const Recording recording = read_recording(folder.path());
  return {recording.wheels.time_s, recording.wheels.series.at(0).value, recording.findings};
}

MATCHER_P3(Is, code, line, count, "") {
  return arg.code == code && arg.place.ends_with("wheels.csv:" + std::to_string(line)) &&
         arg.count == static_cast<std::size_t>(count);
}

TEST(Rows, a_clean_log_has_no_problems) {
  EXPECT_THAT(log_of("0,1\n0.1,2\n0.2,3\n").findings, IsEmpty());
}

TEST(Rows, the_first_of_equal_stamps_is_kept) {
  const Log log = log_of("0,1\n0.1,2\n0.1,3\n0.1,4\n0.2,5\n");
  EXPECT_THAT(log.value, ElementsAre(1, 2, 5));
  EXPECT_THAT(log.findings, ElementsAre(Is(FindingCode::duplicate, 4, 2)));
}

TEST(Rows, a_step_back_costs_the_fewest_rows) {
  const Log back = log_of("0,1\n0.1,2\n0.05,3\n0.2,4\n0.3,5\n");
  EXPECT_THAT(back.time_s, SizeIs(4));
  EXPECT_THAT(back.findings, ElementsAre(Is(FindingCode::back_step, 4, 1)));
  const Log future = log_of("0,1\n0.1,2\n900,3\n0.2,4\n0.3,5\n");
  EXPECT_THAT(future.value, ElementsAre(1, 2, 4, 5));
  EXPECT_THAT(future.findings, ElementsAre(Is(FindingCode::back_step, 5, 1)));
}

TEST(Rows, rows_without_a_stamp_are_left_out) {
  const Log log = log_of("0,1\n,2\nnan,3\n0.2,4\n");
  EXPECT_THAT(log.value, ElementsAre(1, 4));
  EXPECT_THAT(log.findings, ElementsAre(Is(FindingCode::row_without_stamp, 3, 2)));
}

TEST(Rows, empty_cells_are_counted) {
  const Log log = log_of("0,1\n0.1,\n0.2,NaN\n0.3,4\n");
  EXPECT_THAT(log.time_s, SizeIs(4));
  EXPECT_THAT(log.findings, ElementsAre(Is(FindingCode::cell_without_number, 3, 2)));
}

TEST(Rows, gaps_are_longer_than_half_a_second_and_five_median_steps) {
  EXPECT_THAT(log_of("0,1\n0.1,2\n0.2,3\n0.7,4\n0.8,5\n").findings, IsEmpty());
  const Log log = log_of("0,1\n0.1,2\n# here\n0.71,3\n0.81,4\n2,5\n");
  EXPECT_THAT(log.findings, ElementsAre(Is(FindingCode::gap, 5, 2)));
  EXPECT_THAT(log_of("0,1\n1,2\n2,3\n6.9,4\n").findings, IsEmpty());
  EXPECT_THAT(log_of("0,1\n1,2\n2,3\n7.1,4\n").findings, ElementsAre(Is(FindingCode::gap, 5, 1)));
}

TEST(Rows, a_cut_off_last_line_is_told) {
  EXPECT_THAT(log_of("0,1\n0.1,2\n0.2").findings, ElementsAre(Is(FindingCode::cut_off, 4, 1)));
}

TEST(Rows, sightings_may_share_stamps_and_are_sorted) {
  const test::Folder folder;
  folder.write("sightings.csv",
               "time_s,landmark,range_m,bearing_rad\n0,a,1,0\n0,b,2,0\n2,c,3,0\n1,d,4,0\n3,e,,0\n4,f,-1,0\n");
  const Recording recording = read_recording(folder.path());
  std::string names;
  for (const Sighting& sighting : recording.sightings) names += sighting.landmark;
  EXPECT_EQ(names, "abdc");
  const auto count = [&](FindingCode code) {
    return std::count_if(recording.findings.begin(), recording.findings.end(),
                         [&](const Finding& p) { return p.code == code; });
  };
  EXPECT_EQ(count(FindingCode::back_step), 1);
  EXPECT_EQ(count(FindingCode::sighting_without_number), 1);
  EXPECT_EQ(count(FindingCode::gap), 0);
}

}  // namespace
}  // namespace trundle::recording
