// recording.toml that reads a good log in a wrong way: one line says what was seen and what to write.
#include <cmath>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "trundle/io/error.hpp"
#include "trundle/recording/recording.hpp"

#include "recording/findings.hpp"
#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// How a logger writes its stamps.
struct Clock {
  const char* unit = "s";
  double per_second = 1.0;
  double start_s = 0.0;
};

/// A minute at 20 Hz: stop and go, turns both ways. Counts go on, or are those since the row before.
std::string log_of(const Clock& clock, bool increments) {
  std::mt19937 random(3);
  std::normal_distribution<double> tremble(0.0, 1.0);
  std::string rows = "stamp,left,right\n";
  double left = 0.0, right = 0.0;
  for (int row = 0; row < 1200; ++row) {
    const double t = 0.05 * row;
    const double speed = std::fmod(t, 12.0) < 3.0 ? 0.0 : 60.0 * std::min(1.0, std::fmod(t, 12.0) - 3.0);
    const double turn = 25.0 * std::sin(0.3 * t) * (speed > 0.0 ? 1.0 : 0.0);
    const double l = speed > 0.0 ? std::round(speed - turn + tremble(random)) : 0.0;
    const double r = speed > 0.0 ? std::round(speed + turn + tremble(random)) : 0.0;
    left += l;
    right += r;
    rows += fmt::format("{:.0f},{},{}\n", (clock.start_s + t) * clock.per_second, increments ? l : left,
                        increments ? r : right);
  }
  return rows;
}

Recording read(const std::string& log, const std::string& keys) {
  const test::Folder folder;
  folder.write("log.csv", log);
  folder.write("recording.toml", "[wheels]\nfile = \"log.csv\"\n" + keys +
                                     "columns = { time_s = \"stamp\", left_ticks = \"left\", right_ticks = "
                                     "\"right\" }\n");
  return read_recording(folder.path());
}

constexpr Clock kMillis{"ms", 1e3, 2.0};
constexpr Clock kMicros{"us", 1e6, 2.0};
constexpr Clock kUnixMillis{"ms", 1e3, 1.7e9};
constexpr Clock kUnixNanos{"ns", 1e9, 1.7e9};

TEST(Increments, counts_since_the_row_before_that_are_taken_for_a_counter_are_named) {
  const Recording recording = read(log_of(kMillis, true), "time_unit = \"ms\"\n");
  EXPECT_THAT(recording.findings,
              ElementsAre(test::finding(FindingCode::increments, "left_ticks and right_ticks stay between")));
  EXPECT_THAT(recording.findings,
              ElementsAre(test::finding(FindingCode::increments, "write increments = true")));
}

TEST(Increments, a_counter_that_is_taken_for_counts_since_the_row_before_is_named) {
  const Recording recording = read(log_of(kMillis, false), "time_unit = \"ms\"\nincrements = true\n");
  EXPECT_THAT(recording.findings,
              ElementsAre(test::finding(FindingCode::not_increments, "leave out increments = true")));
}

TEST(Increments, what_is_read_rightly_is_no_problem) {
  EXPECT_THAT(read(log_of(kMillis, false), "time_unit = \"ms\"\n").findings, IsEmpty());
  EXPECT_THAT(read(log_of(kMillis, true), "time_unit = \"ms\"\nincrements = true\n").findings, IsEmpty());
}

TEST(Increments, a_counter_at_rest_between_two_counts_is_no_problem) {
  std::string rows = "stamp,left,right\n";
  for (int row = 0; row < 400; ++row) rows += fmt::format("{},{},{}\n", 50 * row, row % 2, (row / 2) % 3);
  EXPECT_THAT(read(rows, "time_unit = \"ms\"\n").findings, IsEmpty());
}

TEST(Increments, a_robot_that_rocks_to_and_fro_is_no_problem) {
  std::string rows = "stamp,left,right\n";
  for (int row = 0; row < 2000; ++row)
    rows += fmt::format("{},{:.0f},{:.0f}\n", 50 * row, 400.0 * std::sin(0.05 * row),
                        380.0 * std::sin(0.05 * row));
  EXPECT_THAT(read(rows, "time_unit = \"ms\"\n").findings, IsEmpty());
}

/// Headings [deg] of a robot that turns to and fro, in the file as a tracker writes them.
std::vector<Finding> findings_of_headings(double rate_hz, double times, bool wrapped) {
  const test::Folder folder;
  std::string rows = "time_s,x_m,y_m,heading_rad\n";
  for (int row = 0; row < 400; ++row) {
    const double heading = 400.0 * std::sin(0.1 * row / rate_hz);
    rows += fmt::format("{},0,0,{}\n", row / rate_hz,
                        times * (wrapped ? std::remainder(heading, 360.0) : heading));
  }
  folder.write("reference.csv", rows);
  return read_recording(folder.path()).findings;
}

TEST(Headings, degrees_that_are_taken_for_radians_are_named_by_themselves) {
  for (const bool wrapped : {true, false}) {
    EXPECT_THAT(findings_of_headings(5.0, 1.0, wrapped),
                ElementsAre(test::finding(FindingCode::reference_unit, "unit = \"deg\" at heading_rad")));
    EXPECT_THAT(findings_of_headings(5.0, radians(1.0), wrapped), IsEmpty());
    EXPECT_THAT(findings_of_headings(1.0, radians(1.0), wrapped), IsEmpty());
  }
}

struct WrongUnit {
  Clock clock;
  const char* written;  ///< in recording.toml
};

TEST(TimeUnit, stamps_that_cannot_be_seconds_are_refused_with_the_unit_to_write) {
  for (const auto& [clock, written] :
       {WrongUnit{kMillis, "s"}, WrongUnit{kMicros, "s"}, WrongUnit{kUnixMillis, "s"},
        WrongUnit{kUnixNanos, "s"}, WrongUnit{kUnixNanos, "us"}, WrongUnit{kUnixNanos, "ms"},
        WrongUnit{kMillis, "ns"}, WrongUnit{kMillis, "us"}}) {
    SCOPED_TRACE(fmt::format("{} read as {}, from {} s", clock.unit, written, clock.start_s));
    try {
      read(log_of(clock, false), fmt::format("time_unit = \"{}\"\n", written));
      ADD_FAILURE() << "accepted";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("recording.toml:1: the stamps of"));
      EXPECT_THAT(error.what(), HasSubstr(fmt::format("expected time_unit = \"{}\"", clock.unit)));
    }
  }
}

TEST(TimeUnit, is_no_problem_where_it_is_right) {
  for (const Clock& clock : {kMillis, kMicros, kUnixMillis, kUnixNanos})
    EXPECT_THAT(read(log_of(clock, false), fmt::format("time_unit = \"{}\"\n", clock.unit)).findings,
                IsEmpty())
        << clock.unit;
}

TEST(TimeUnit, of_a_native_file_is_told_as_a_problem) {
  const test::Folder folder;
  std::string rows = "time_s,left_ticks\n";
  for (int row = 0; row < 40; ++row) rows += fmt::format("{},{}\n", 20'000'000LL * row, 7 * row);
  folder.write("wheels.csv", rows);
  EXPECT_THAT(read_recording(folder.path()).findings,
              Contains(test::finding(FindingCode::time_unit, "time_unit = \"ns\"")));
}

TEST(TimeUnit, points_surveyed_every_two_minutes_are_no_problem) {
  const test::Folder folder;
  std::string rows = "time_s,x_m,y_m\n";
  for (int row = 0; row < 40; ++row) rows += fmt::format("{},{},0\n", 120 * row, row);
  folder.write("reference.csv", rows);
  EXPECT_THAT(read_recording(folder.path()).findings, IsEmpty());
}

/// What is said of a file and a recording.toml in which all columns go by number.
std::string refusal(const std::string& file, const std::string& keys) {
  const test::Folder folder;
  folder.write("log.csv", file);
  folder.write("recording.toml",
               "[wheels]\nfile = \"log.csv\"\n" + keys + "columns = { time_s = 1, left_ticks = 2 }\n");
  try {
    const Recording recording = read_recording(folder.path());
    return recording.findings.empty() ? "" : describe(recording.findings.front());
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(Header, that_is_not_there_is_named) {
  EXPECT_THAT(refusal("0,0,0\n0.1,3,4\n", ""), HasSubstr("expected header = false in recording.toml"));
  EXPECT_THAT(refusal("0,1,2\n0.1,3,4\n", ""), HasSubstr("write header = false"));
  EXPECT_EQ(refusal("0,1,2\n0.1,3,4\n", "header = false\n"), "");
  const test::Folder folder;
  folder.write("wheels.csv", "0,1,2\n0.1,3,4\n");
  EXPECT_THROW(read_recording(folder.path()), InputError);
}

TEST(Header, that_is_taken_for_a_row_is_named) {
  EXPECT_THAT(refusal("stamp,left\n0,3\n0.1,4\n", "header = false\n"),
              AllOf(HasSubstr("column 1 holds 'stamp'"), HasSubstr("header = true in recording.toml")));
}

TEST(Delimiter, that_the_file_has_is_named) {
  for (const auto& [sign, word] : {std::pair{';', ";"}, {'\t', "\\t"}, {'|', "|"}, {' ', "whitespace"}}) {
    EXPECT_THAT(refusal(fmt::format("0{0}0{0}0\n0.1{0}3{0}4\n", sign), "header = false\n"),
                HasSubstr(fmt::format("expected delimiter = \"{}\" in recording.toml", word)));
    EXPECT_EQ(refusal(fmt::format("0{0}0{0}0\n0.1{0}3{0}4\n", sign),
                      fmt::format("header = false\ndelimiter = \"{}\"\n", word)),
              "");
  }
}

TEST(Bearings, in_degrees_are_named) {
  const auto kinds = [](double turn) {
    std::string rows = "time_s,landmark,range_m,bearing_rad\n";
    for (int i = 0; i < 100; ++i) rows += fmt::format("{},a,2,{}\n", 0.1 * i, turn * (0.01 * i - 0.5));
    const test::Folder folder;
    folder.write("sightings.csv", rows);
    std::vector<FindingCode> found;
    for (const Finding& problem : read_recording(folder.path()).findings) found.push_back(problem.code);
    return found;
  };
  EXPECT_THAT(kinds(360.0), ElementsAre(FindingCode::bearing_unit));
  EXPECT_THAT(kinds(12.4), ElementsAre());
}

TEST(Decimal, commas_are_named_and_read) {
  const std::string file = "0,0;0;0\n0,1;3;4\n";
  EXPECT_THAT(refusal(file, "header = false\ndelimiter = \";\"\n"),
              AllOf(HasSubstr("column 1 holds '0,0'"), HasSubstr("decimal = \",\" in recording.toml")));
  EXPECT_EQ(refusal(file, "header = false\ndelimiter = \";\"\ndecimal = \",\"\n"), "");
  const test::Folder folder;
  folder.write("log.csv", "t;l\n0,25;-1,5e1\n0,5;2\n");
  folder.write("recording.toml",
               "[wheels]\nfile = \"log.csv\"\ndelimiter = \";\"\ndecimal = \",\"\n"
               "columns = { time_s = \"t\", left_m = \"l\" }\n");
  const Recording recording = read_recording(folder.path());
  EXPECT_THAT(recording.wheels.time_s, ElementsAre(0.25, 0.5));
  EXPECT_THAT(recording.wheels.series[0].value, ElementsAre(-15.0, 2.0));
}

}  // namespace
}  // namespace trundle::recording
