// `trundle live`: lines in, lines out, as a robot and somebody who kills it would use them.
#include <algorithm>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"

#include "app/demo.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;
using Json = nlohmann::json;

const std::string kDemoTour = (kDemo / "session_01/tour").string();

std::vector<std::string> lines_in(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::string> cells_in(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

std::vector<std::vector<std::string>> rows_of(const std::filesystem::path& file) {
  std::vector<std::vector<std::string>> rows;
  for (const std::string& line : lines_in(read_file(file)))
    if (!line.starts_with("#") && !line.starts_with("time_s")) rows.push_back(cells_in(line));
  return rows;
}

/// Of all that is seen at one stamp.
std::map<std::string, std::string> sightings_of_tour() {
  std::map<std::string, std::string> seen;
  for (const auto& row : rows_of(std::filesystem::path(kDemoTour) / "sightings.csv")) {
    std::string& at = seen[row[0]];
    at += fmt::format(R"({}{{"landmark":"{}","range_m":{},"bearing_rad":{}}})", at.empty() ? "" : ",", row[1],
                      row[2], row[3]);
  }
  return seen;
}

/// The demo's tour as the robot would have told it: each reading of wheels or gyro at its stamp.
std::string tour_as_lines(bool with_sightings = false) {
  std::multimap<double, std::string> lines;
  for (const auto& row : rows_of(std::filesystem::path(kDemoTour) / "wheels.csv"))
    lines.emplace(std::stod(row[0]),
                  fmt::format(R"({{"time_s":{},"wheels":{{"left_ticks":{},"right_ticks":{}}}}})", row[0],
                              row[1], row[2]));
  for (const auto& row : rows_of(std::filesystem::path(kDemoTour) / "gyro.csv"))
    lines.emplace(std::stod(row[0]), fmt::format(R"({{"time_s":{},"gyro":{}}})", row[0], row[1]));
  if (with_sightings)
    for (const auto& [time_s, seen] : sightings_of_tour())
      lines.emplace(std::stod(time_s), fmt::format(R"({{"time_s":{},"sightings":[{}]}})", time_s, seen));
  std::string text;
  for (const auto& [time_s, line] : lines) text += line + "\n";
  return text;
}

/// That tour with a line between its seventh and its eighth.
std::string tour_with_line_8(const std::string& inserted) {
  std::vector<std::string> lines = lines_in(tour_as_lines());
  lines.insert(lines.begin() + 7, inserted);
  std::string text;
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

class LiveCommand : public testing::Test {
 protected:
  LiveCommand() { keep("tour.jsonl", tour_as_lines()); }

  void keep(const std::string& file, const std::string& text) const {
    write_file(sample_.folder() / file, text);
  }
  Outcome live(Arguments more = {}, Circumstances circumstances = {.input = "tour.jsonl"}) const {
    more.insert(more.begin(), {"live", "--robot", kDemoRobot});
    return run_program(sample_.folder(), more, circumstances);
  }

  Sample sample_;
};

TEST_F(LiveCommand, GivesTheTextOfTheTrajectoryFile) {
  const Outcome outcome = live();
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, IsEmpty());
  run_program(sample_.folder(), {"odometry", kDemoTour, "--robot", kDemoRobot, "-o", "t.csv"});
  const auto expected = rows_of(sample_.folder() / "t.csv");
  const auto lines = lines_in(outcome.out);
  ASSERT_EQ(lines.size(), expected.size());
  constexpr std::array kNames = {"time_s", "x_m",    "y_m",    "heading_rad", "var_xx",
                                 "var_xy", "var_xh", "var_yy", "var_yh",      "var_hh"};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::string start = "{";
    for (std::size_t k = 0; k < kNames.size(); ++k)
      start += fmt::format("{}\"{}\":{}", k > 0 ? "," : "", kNames[k], expected[i][k]);
    ASSERT_THAT(lines[i], StartsWith(start + ","));
    ASSERT_TRUE(Json::accept(lines[i])) << lines[i];
  }
}

TEST_F(LiveCommand, GivesTheTextOfTheMapperForSightings) {
  keep("seen.jsonl", tour_as_lines(true) + R"({"time_s": 1000, "map": true})" + "\n");
  const Outcome outcome = live({"--window", "20"}, {.input = "seen.jsonl"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, IsEmpty());
  run_program(sample_.folder(), {"slam", kDemoTour, "--robot", kDemoRobot, "--window", "20", "-o", "slam"});
  std::map<std::string, std::vector<std::string>> expected;
  for (const auto& row : rows_of(sample_.folder() / "slam/trajectory.csv")) expected[row[0]] = row;
  std::size_t seen = 0;
  std::string without;
  for (const std::string& line : lines_in(outcome.out)) {
    const Json document = Json::parse(line);
    if (document.contains("map")) {
      EXPECT_EQ(document["map"].size(), rows_of(sample_.folder() / "slam/landmarks.csv").size() - 1);
    } else if (document.contains("sightings")) {
      ++seen;
      const std::string time_s = line.substr(10, line.find(',') - 10);
      const auto& row = expected.at(time_s);
      EXPECT_THAT(line, HasSubstr(fmt::format(R"("slam":{{"x_m":{},"y_m":{},"heading_rad":{},"var_xx":{},)",
                                              row[1], row[2], row[3], row[4])));
    } else {
      without += line.substr(0, line.find(R"(,"slam":)")) + (document.contains("slam") ? "}\n" : "\n");
    }
  }
  EXPECT_EQ(seen, sightings_of_tour().size());
  EXPECT_EQ(without, live().out);  // sightings change nothing of the odometry
}

TEST_F(LiveCommand, KilledAtAnyMomentItGoesOnAsIfNothingHadHappened) {
  const std::string tour = tour_as_lines(true);
  keep("tour.jsonl", tour);
  const std::string whole = live().out;
  int resumed_ones = 0;
  for (std::size_t given = 1'000; given < tour.size(); given += tour.size() / 8) {
    std::filesystem::remove(sample_.folder() / "state");
    const Outcome killed = live({"--checkpoint", "state", "--checkpoint-every-s", "2"},
                                {.input = "tour.jsonl", .ended_after_input = given});
    EXPECT_EQ(killed.exit_code, -1);
    EXPECT_THAT(whole, StartsWith(killed.out));
    EXPECT_LT(killed.out.size(), whole.size());
    if (!std::filesystem::exists(sample_.folder() / "state")) continue;
    ++resumed_ones;
    const Outcome resumed = live({"--resume", "state"});
    EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
    EXPECT_THAT(whole, testing::EndsWith(resumed.out)) << "after " << given << " bytes";
    EXPECT_GE(killed.out.size() + resumed.out.size(), whole.size()) << "after " << given << " bytes";
  }
  EXPECT_GT(resumed_ones, 5);
}

TEST_F(LiveCommand, GoesOnWithInputThatBeginsWhereTheCheckpointWasWritten) {
  const std::vector<std::string> lines = lines_in(tour_as_lines());
  const std::size_t half = lines.size() / 2;
  std::string first, second;
  for (std::size_t i = 0; i < lines.size(); ++i) (i < half ? first : second) += lines[i] + "\n";
  keep("first.jsonl", first);
  keep("second.jsonl", second);
  const Outcome a = live({"--checkpoint", "state", "--checkpoint-every-s", "0"}, {.input = "first.jsonl"});
  const Outcome b = live({"--resume", "state"}, {.input = "second.jsonl"});
  const std::string whole = live().out;
  // The last answer was given without what the gyro said later.
  EXPECT_THAT(whole, StartsWith(a.out.substr(0, a.out.rfind('\n', a.out.size() - 2) + 1)));
  EXPECT_THAT(whole, testing::EndsWith(b.out));
  EXPECT_GE(a.out.size() + b.out.size(), whole.size());
}

TEST_F(LiveCommand, GoesOnWhereLinesWithoutASampleStandBetween) {
  std::string text;
  for (const std::string& line : lines_in(tour_as_lines()))
    text += line + "\n" + R"({"time_s": 1, "sightings": []})" + "\n";
  keep("tour.jsonl", text);
  const std::string whole = live({"--checkpoint", "state"}).out;
  const Outcome resumed = live({"--resume", "state"});
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(whole, testing::EndsWith(resumed.out));
}

TEST_F(LiveCommand, InputWithoutLineEndsIsRefused) {
  keep("endless.jsonl", tour_as_lines() + std::string(3 << 20, ' '));
  const Outcome outcome = live({"--json"}, {.input = "endless.jsonl"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("a line of more than a million bytes"));
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1);
  EXPECT_EQ(Json::parse(outcome.out).at("estimates").size(), lines_in(live().out).size());
}

TEST_F(LiveCommand, ALineThatIsWrongIsNamedAndLeftOut) {
  keep("wrong.jsonl", tour_with_line_8(R"({"time_s": 0.1, "wheels": )"));
  const Outcome outcome = live({}, {.input = "wrong.jsonl"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, StartsWith("trundle: stdin:8: "));
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1);
  EXPECT_EQ(outcome.out, live().out);
}

TEST_F(LiveCommand, AStampFarAheadIsLeftOutByItself) {
  const std::string text = tour_with_line_8(R"({"time_s": 1e12, "gyro": 0.0})");
  keep("wrong.jsonl", text);
  const Outcome outcome = live({"--checkpoint", "state"}, {.input = "wrong.jsonl"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, StartsWith("trundle: stdin:8: a stamp of 1000000000000 s, after a reading at "));
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1);
  EXPECT_EQ(outcome.out, live().out);
  // What is known already is passed over, the garbled line or not.
  keep("longer.jsonl", text + R"({"time_s": 1000, "gyro": 0.0})" + "\n");
  const Outcome resumed = live({"--resume", "state"}, {.input = "longer.jsonl"});
  EXPECT_EQ(std::ranges::count(resumed.err, '\n'), 1) << resumed.err;
  EXPECT_LE(lines_in(resumed.out).size(), 2U);
}

TEST_F(LiveCommand, ALogThatGoesOnDaysLaterIsTakenUpWithItsSecondLine) {
  const std::string later = R"({"time_s":864000,"wheels":{"left_ticks":5000,"right_ticks":5000}})"
                            "\n"
                            R"({"time_s":864000.1,"wheels":{"left_ticks":5001,"right_ticks":5001}})"
                            "\n"
                            R"({"time_s":864000.2,"wheels":{"left_ticks":5002,"right_ticks":5002}})"
                            "\n"
                            R"({"time_s":864000.3,"wheels":{"left_ticks":5003,"right_ticks":5003}})"
                            "\n";
  keep("days.jsonl", tour_as_lines() + later);
  const Outcome outcome = live({}, {.input = "days.jsonl"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr(R"({"time_s":864000.2,)"));
}

TEST_F(LiveCommand, ACheckpointThatCannotBeStoredLosesNoAnswer) {
  const Outcome outcome = live({"--checkpoint", "/proc/state", "--json"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("/proc/state"));
  EXPECT_EQ(Json::parse(outcome.out).at("estimates").size(), lines_in(live().out).size());
}

TEST_F(LiveCommand, ACheckpointOfAnotherRobotIsRefused) {
  ASSERT_EQ(live({"--checkpoint", "state"}).exit_code, 0);
  keep("other.toml", read_file(kDemoRobot) + "# another\n");
  const Outcome other =
      run_program(sample_.folder(), {"live", "--robot", "other.toml", "--resume", "state", "--json"},
                  Circumstances{.input = "tour.jsonl"});
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_THAT(other.out, IsEmpty());
  EXPECT_THAT(other.err, HasSubstr("another robot file"));
  keep("state", read_file(sample_.folder() / "state").substr(0, 1000));
  EXPECT_EQ(live({"--resume", "state"}).exit_code, 3);
  EXPECT_EQ(live({"--resume", "nowhere"}).exit_code, 3);
  EXPECT_EQ(live({"--resume", "tour.jsonl"}).exit_code, 3);
}

TEST_F(LiveCommand, SightingsThatComeTooLateAreNamedAndLeftOut) {
  keep("late.jsonl",
       tour_with_line_8(R"({"time_s": 0.04, "sightings": [{"range_m": 1, "bearing_rad": 0}]})"));
  const Outcome outcome = live({}, {.input = "late.jsonl"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, StartsWith("trundle: stdin:8: 'sightings' at 0.04 s come 0.06"));
  EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1);
  EXPECT_EQ(outcome.out, live().out);
  EXPECT_EQ(live({"--late-s", "0.2"}, {.input = "late.jsonl"}).exit_code, 0);
}

TEST_F(LiveCommand, JsonIsOneDocumentAndQuietIsQuiet) {
  const Json document = Json::parse(live({"--json"}).out);
  EXPECT_EQ(document.at("program"), "trundle");
  EXPECT_EQ(document.at("inputs").at(0).at("sha256").get<std::string>().size(), 64U);
  EXPECT_EQ(document.at("estimates").size(), lines_in(live().out).size());
  const Outcome quiet = live({"--quiet"});
  EXPECT_THAT(quiet.out + quiet.err, IsEmpty());
}

// Nothing that was not told is stored as done.
TEST_F(LiveCommand, WhatCannotBePrintedIsAnError) {
  const std::string command = std::string(TRUNDLE_PROGRAM) + " live --robot " + kDemoRobot +
                              " --checkpoint state < tour.jsonl > /dev/full";
  const Outcome outcome = run_program(sample_.folder(), {"-c", command}, {.program = "/bin/sh"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, StartsWith("trundle: standard output: cannot be written"));
  EXPECT_FALSE(std::filesystem::exists(sample_.folder() / "state"));
}

TEST_F(LiveCommand, NoInputIsNoOutput) {
  keep("nothing.jsonl", "");
  const Outcome outcome = live({"--checkpoint", "state"}, {.input = "nothing.jsonl"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_EQ(live({"--resume", "state"}).out, live().out);
}

// 99 of 100 readings within a millisecond. A hundredth of that is usual; other programs may want the
// processor.
TEST_F(LiveCommand, ALineTakesLessThanAMillisecond) {
  double best_us = 1e9;
  for (int attempt = 0; attempt < 5 && best_us >= 1000.0; ++attempt) {
    const Outcome outcome = live({"--timing"});
    std::smatch p99;
    ASSERT_TRUE(std::regex_search(outcome.err, p99, std::regex("p99 ([0-9.]+) µs"))) << outcome.err;
    best_us = std::min(best_us, std::stod(p99[1]));
  }
  EXPECT_LT(best_us, 1000.0);
}

}  // namespace
}  // namespace trundle::test
