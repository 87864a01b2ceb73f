#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/recording.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

/// A folder with one foreign file and the map that reads it.
Recording mapped(const std::string& file, const std::string& map) {
  const test::Folder folder;
  folder.write("log.txt", file);
  folder.write("recording.toml", map);
  return read_recording(folder.path());
}

TEST(RecordingMap, reads_columns_by_name_and_by_number) {
  const Recording by_name = mapped("stamp,l,r\n0,1,2\n0.1,3,4\n", R"(
session = "monday"
[wheels]
file = "log.txt"
columns = { time_s = "stamp", left_ticks = "l", right_ticks = 3 }
)");
  EXPECT_EQ(by_name.session, "monday");
  ASSERT_THAT(by_name.wheels.series, SizeIs(2));
  EXPECT_EQ(by_name.wheels.series[0].wheel, "left");
  EXPECT_THAT(by_name.wheels.series[0].value, ElementsAre(1, 3));
  EXPECT_THAT(by_name.wheels.series[1].value, ElementsAre(2, 4));
  EXPECT_THAT(by_name.inputs, SizeIs(2));
  const Recording by_number = mapped("0;1;2\n0.1;3;4\n", R"(
[wheels]
file = "log.txt"
delimiter = ";"
header = false
columns.time_s = 1
columns.left_ticks = 2
)");
  EXPECT_THAT(by_number.wheels.series[0].value, ElementsAre(1, 3));
}

TEST(RecordingMap, applies_unit_scale_and_sign) {
  const Recording recording = mapped("t,l,w,x,h\n0,10,90,2,180\n100,20,45,1,90\n", R"(
[wheels]
file = "log.txt"
time_unit = "ms"
columns.time_s = "t"
columns.left_m = { column = "l", unit = "cm", sign = -1 }
columns.right_rad = { column = "l", unit = "rev" }
[gyro]
file = "log.txt"
time_unit = "ms"
columns.time_s = "t"
columns.yaw_rate_rad_s = { column = "w", unit = "deg/s", scale = 2 }
[reference]
file = "log.txt"
time_unit = "ms"
time_offset_s = 5
columns.time_s = "t"
columns.x_m = { column = "x", unit = "in" }
columns.heading_rad = { column = "h", unit = "deg" }
[accel]
file = "log.txt"
time_unit = "ms"
columns.time_s = "t"
columns.x_m_s2 = { column = "x", unit = "g" }
)");
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0, 0.1));
  EXPECT_THAT(recording.wheels.series[0].value, ElementsAre(-0.1, -0.2));
  EXPECT_DOUBLE_EQ(recording.wheels.series[1].value[1], 40.0 * kPi);
  EXPECT_DOUBLE_EQ(recording.gyro.yaw_rate_rad_s[1], kPi / 2.0);
  EXPECT_THAT(recording.reference.time_s, ElementsAre(5, 5.1));
  EXPECT_DOUBLE_EQ(recording.reference.x_m[0], 0.0508);
  EXPECT_TRUE(std::isnan(recording.reference.y_m[0]));
  EXPECT_DOUBLE_EQ(recording.reference.heading_rad[1], kPi / 2.0);
  EXPECT_DOUBLE_EQ(recording.accel.x_m_s2[0], 19.6133);
}

TEST(RecordingMap, sums_increments_over_all_rows_even_those_it_drops) {
  const Recording recording = mapped("0,1\n0.1,2\n0.1,4\n,8\n0.2,\n0.3,16\n", R"(
[wheels]
file = "log.txt"
header = false
increments = true
columns = { time_s = 1, left_ticks = 2 }
)");
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0, 0.1, 0.2, 0.3));
  EXPECT_THAT(recording.wheels.series[0].value, ElementsAre(1, 3, 15, 31));
}

TEST(RecordingMap, makes_stamps_of_a_rate_and_cuts) {
  const Recording recording = mapped("1\n2\n3\n4\n5\n", R"(
[wheels]
file = "log.txt"
header = false
rate_hz = 10
start_s = 0.1
end_s = 0.3
columns.left_ticks = 1
)");
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0.1, 0.2, 0.3));
  EXPECT_THAT(recording.wheels.series[0].value, ElementsAre(2, 3, 4));
}

TEST(RecordingMap, nanoseconds_keep_their_precision_from_an_origin) {
  constexpr const char* kFile = "t,l\n1494449906828639784,1\n1494449906848379493,2\n";
  const std::string wheels = R"(
[wheels]
file = "log.txt"
time_unit = "ns"
columns = { time_s = "t", left_ticks = "l" }
)";
  EXPECT_THAT(mapped(kFile, "time_origin = \"first\"" + wheels).wheels.time_s,
              ElementsAre(0.828639784, 0.848379493));
  EXPECT_THAT(mapped(kFile, "time_origin = 1494449900" + wheels).wheels.time_s,
              ElementsAre(6.828639784, 6.848379493));
  EXPECT_THAT(mapped(kFile, wheels).wheels.time_s, ElementsAre(1494449906.828639784, 1494449906.848379493));
}

TEST(RecordingMap, the_origin_is_one_for_all_streams) {
  const Recording recording = mapped("t,l\n1000000000.5,1\n1000000001.5,2\n", R"(
time_origin = "first"
[wheels]
file = "log.txt"
columns = { time_s = "t", left_ticks = "l" }
[gyro]
file = "log.txt"
time_offset_s = 7
columns = { time_s = "t", yaw_rate_rad_s = "l" }
)");
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0.5, 1.5));
  EXPECT_THAT(recording.gyro.time_s, ElementsAre(7.5, 8.5));
}

TEST(RecordingMap, skips_comments_of_its_own_kind_and_reads_absolute_paths) {
  const test::Folder folder;
  const std::filesystem::path file =
      folder.write("elsewhere/log.txt", "% made by a robot\n0 1\n% between\n1 2\n");
  folder.write("recording.toml", fmt::format(R"(
[wheels]
file = "{}"
delimiter = "whitespace"
comment = "%"
header = false
columns = {{ time_s = 1, left_ticks = 2 }}
)",
                                             file.string()));
  EXPECT_THAT(read_recording(folder.path()).wheels.series[0].value, ElementsAre(1, 2));
}

TEST(RecordingMap, one_column_may_feed_several) {
  const Recording recording = mapped("t,v\n0,1\n1,2\n", R"(
[wheels]
file = "log.txt"
columns = { time_s = "t", front_rad_s = "v", rear_rad_s = { column = "v", scale = 2 } }
)");
  EXPECT_THAT(recording.wheels.series[0].value, ElementsAre(1, 2));
  EXPECT_THAT(recording.wheels.series[1].value, ElementsAre(2, 4));
}

TEST(RecordingMap, reads_sightings_and_relative_motions) {
  const Recording recording = mapped("t,e,id,r,b\n0,500,tree,1,90\n500,1000,,2,45\n", R"(
[sightings]
file = "log.txt"
time_unit = "ms"
columns = { time_s = "t", landmark = "id", range_m = "r", bearing_rad = { column = "b", unit = "deg" } }
[relative_motion]
file = "log.txt"
time_unit = "ms"
columns = { start_s = "t", end_s = "e", dx_m = "r", dy_m = "r", dheading_rad = { column = "b", unit = "deg" } }
)");
  ASSERT_THAT(recording.sightings, SizeIs(2));
  EXPECT_EQ(recording.sightings[0].landmark, "tree");
  EXPECT_DOUBLE_EQ(recording.sightings[0].bearing_rad, kPi / 2.0);
  ASSERT_THAT(recording.relative_motions, SizeIs(2));
  EXPECT_EQ(recording.relative_motions[1].start_s, 0.5);
  EXPECT_EQ(recording.relative_motions[1].end_s, 1.0);
  EXPECT_EQ(recording.relative_motions[1].motion.x, 2.0);
}

TEST(RecordingMap, a_relative_motion_with_a_missing_part_is_refused_at_its_row) {
  const test::Folder folder;
  folder.write("relative.csv", "start_s,end_s,dx_m,dy_m,dheading_rad\n0,1,0.1,0,0.1\n1,2,0.1,,0.1\n");
  try {
    (void)read_recording(folder.path());
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("relative.csv:3"));
  }
}

TEST(RecordingMap, native_files_beside_it_are_read_where_it_maps_nothing) {
  const test::Folder folder;
  folder.write("wheels.csv", "time_s,left_ticks\n0,1\n1,2\n");
  folder.write("gyro.csv", "time_s,yaw_rate_rad_s\n0,1\n");
  folder.write("other.csv", "t,w\n0,7\n");
  folder.write("recording.toml",
               "[gyro]\nfile = \"other.csv\"\ncolumns = { time_s = \"t\", yaw_rate_rad_s = \"w\" }\n");
  const Recording recording = read_recording(folder.path());
  EXPECT_THAT(recording.wheels.time_s, SizeIs(2));
  EXPECT_THAT(recording.gyro.yaw_rate_rad_s, ElementsAre(7));
}

/// Three logs of one layout, two of them with a gyro.
struct Logs : test::Folder {
  Logs() {
    for (const char* run : {"02", "01", "03"}) {
      write(fmt::format("mon_run-{}.csv", run), fmt::format("time_s,left_ticks\n0,{0}\n1,{0}\n", run));
      if (run != std::string("03"))
        write(fmt::format("gyro_{}_mon.csv", run), fmt::format("time_s,yaw_rate_rad_s\n0,{}\n", run));
    }
    write("other.csv", "time_s,left_ticks\n0,7\n");
    map("mon_run-*.csv");
  }
  void map(const std::string& wheels) const {
    write("recording.toml",
          fmt::format(
              "[wheels]\nfile = \"{}\"\ncolumns = {{ time_s = \"time_s\", left_ticks = \"left_ticks\" }}\n"
              "[gyro]\nfile = \"gyro_*_mon.csv\"\n"
              "columns = {{ time_s = \"time_s\", yaw_rate_rad_s = \"yaw_rate_rad_s\" }}\n"
              "[reference]\nturns = 1\n",
              wheels));
  }
};

TEST(RecordingMap, APatternIsOneRecordingForEachMatch) {
  const Logs logs;
  EXPECT_THAT(recordings_below(logs.path()), ElementsAre(logs / "01", logs / "02", logs / "03"));
  EXPECT_THAT(recordings_below(logs.path().parent_path()), SizeIs(3));
  const Recording second = read_recording(logs / "02");
  EXPECT_EQ(second.name, "02");
  EXPECT_EQ(second.session, "run");
  EXPECT_THAT(second.wheels.series.at(0).value, ElementsAre(2, 2));
  EXPECT_THAT(second.gyro.yaw_rate_rad_s, ElementsAre(2)) << "paired by what the star stands for";
  EXPECT_EQ(second.partial.turns->value, 1.0);
  EXPECT_THAT(second.inputs, SizeIs(3)) << "recording.toml and its own files";
  EXPECT_THAT(read_recording(logs / "03").gyro.time_s, testing::IsEmpty());
}

TEST(RecordingMap, AFolderOfSeveralRunsIsNoneOfThem) {
  const Logs logs;
  EXPECT_THAT([&] { read_recording(logs.path()); },
              testing::ThrowsMessage<InputError>(testing::HasSubstr("holds 3 recordings, 01 to 03")));
  EXPECT_THROW(read_recording(logs / "04"), InputError);
}

TEST(RecordingMap, APatternThatMatchesNothingIsAnError) {
  const Logs logs;
  logs.map("tue_run-*.csv");
  EXPECT_THAT([&] { (void)recordings_below(logs.path()); },
              testing::ThrowsMessage<InputError>(
                  testing::HasSubstr("recording.toml:2: [wheels]: no file matches 'tue_run-*.csv'")));
  logs.map("*/run.csv");
  EXPECT_THROW((void)recordings_below(logs.path()), InputError);
}

TEST(RecordingMap, TwoStarsNameARunTogether) {
  const Logs logs;
  logs.map("*_run-*.csv");
  EXPECT_THAT(recordings_below(logs.path()), testing::Contains(logs / "mon_01"));
}

// What means something in an expression means itself in a file's name.
TEST(RecordingMap, PatternsTakeFileNamesAsTheyAre) {
  const test::Folder folder;
  for (const std::string name : {"run[1]_a", "run[1]_b", "w\\in^{x}_a"})
    folder.write(name + ".csv", "0,1,2\n1,2,3\n");
  const auto runs = [&](const std::string& pattern) {
    folder.write("recording.toml", "[wheels]\nfile = '" + pattern +
                                       "'\nheader = false\ncolumns = { time_s = 1, left_ticks = 2 }\n");
    std::vector<std::string> names;
    for (const auto& path : recordings_below(folder.path())) names.push_back(path.filename().string());
    return names;
  };
  EXPECT_THAT(runs("run[1]_*.csv"), ElementsAre("a", "b"));
  EXPECT_THAT(runs("w\\in^{x}_*.csv"), ElementsAre("a"));
  EXPECT_THROW(runs("runs\\*.csv"), InputError);  // a path of Windows
}

TEST(RecordingMap, StampsHaveNoScaleOfTheirOwn) {
  for (const std::string stamps : {"{ column = 1, scale = 0.05 }", "{ column = 1, sign = -1 }"})
    EXPECT_THAT(
        [&] {
          mapped("0,1,2\n1,2,3\n", "[wheels]\nfile = \"log.txt\"\nheader = false\ncolumns.time_s = " +
                                       stamps + "\ncolumns.left_ticks = 2\n");
        },
        testing::ThrowsMessage<InputError>(testing::HasSubstr("rate_hz")))
        << stamps;
}

TEST(Recordings, WhatACommandWroteBelowThemIsNone) {
  const test::Folder session;
  for (const std::string run : {"a", "b"}) {
    session.write(run + "/wheels.csv", "time_s,left_ticks,right_ticks\n0,1,2\n1,2,3\n");
    session.write("out/" + run + "/run.json", "{}");
    session.write("out/" + run + "/reference.csv", "time_s,x_m,y_m,heading_rad\n0,0,0,0\n1,0,0,0\n");
  }
  EXPECT_THAT(recordings_below(session.path()), ElementsAre(session / "a", session / "b"));
}

PartialReference partial(const std::string& lines) {
  const test::Folder folder;
  folder.write("recording.toml", "[reference]\n" + lines);
  return read_recording(folder.path()).partial;
}

TEST(PartialReference, takes_values_and_sigmas) {
  const PartialReference reference = partial(R"(
distance_m = 2.5
distance_m_sigma = 0.01
turns = -3
turns_sigma = 0.005
end_x_m = 0.1
end_y_m = 0.2
end_heading_deg = 90
end_heading_deg_sigma = 2
)");
  EXPECT_EQ(reference.distance_m->value, 2.5);
  EXPECT_EQ(reference.distance_m->sigma, 0.01);
  EXPECT_EQ(reference.turns->value, -3.0);
  EXPECT_EQ(reference.turns->sigma, 0.005);
  EXPECT_EQ(reference.end_x_m->sigma, kDefaultPositionSigma);
  EXPECT_EQ(reference.end_y_m->value, 0.2);
  EXPECT_DOUBLE_EQ(reference.end_heading_rad->value, kPi / 2.0);
  EXPECT_DOUBLE_EQ(reference.end_heading_rad->sigma, kPi / 90.0);
  EXPECT_FALSE(reference.closed);
}

TEST(PartialReference, closed_closes_position_and_heading_unless_told_otherwise) {
  const PartialReference both = partial("closed = true\n");
  EXPECT_EQ(both.closed->sigma, kDefaultPositionSigma);
  EXPECT_EQ(both.closed_heading->sigma, kDefaultHeadingSigma);
  const PartialReference with_sigmas =
      partial("closed = true\nclosed_sigma_m = 0.02\nclosed_sigma_deg = 3\n");
  EXPECT_EQ(with_sigmas.closed->sigma, 0.02);
  EXPECT_DOUBLE_EQ(with_sigmas.closed_heading->sigma, kPi / 60.0);
  EXPECT_FALSE(partial("closed = true\nclosed_heading = false\n").closed_heading);
  const PartialReference heading = partial("closed_heading = true\n");
  EXPECT_FALSE(heading.closed);
  EXPECT_TRUE(heading.closed_heading);
}

TEST(PartialReference, stands_beside_a_trajectory) {
  const Recording recording = mapped("t,h\n0,1\n", R"(
[reference]
turns = 2
file = "log.txt"
columns = { time_s = "t", heading_rad = "h" }
)");
  EXPECT_EQ(recording.partial.turns->value, 2.0);
  EXPECT_THAT(recording.reference.heading_rad, ElementsAre(1));
}

}  // namespace
}  // namespace trundle::recording
