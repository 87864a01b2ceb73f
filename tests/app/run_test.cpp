// `trundle run` is the single commands in turn: the same bytes, and a word on every stage.
#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"
#include "trundle/io/staging.hpp"

#include "app/demo.hpp"
#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"
#include "scale.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using Json = nlohmann::json;

/// A fresh folder with the inputs of a Sample, and the demo's recordings under their own paths.
class RunCommand : public testing::Test {
 protected:
  Outcome run(const Arguments& arguments) const { return run_program(sample_.folder(), arguments); }
  std::string read(const std::string& file) const { return read_file(sample_.folder() / file); }
  Json json(const std::string& file) const { return Json::parse(read(file)); }
  bool exists(const std::string& file) const { return std::filesystem::exists(sample_.folder() / file); }
  void keep(const std::string& file, const std::string& text) const {
    write_file(sample_.folder() / file, text);
  }
  /// The entry of a stage in DIR/run.json.
  Json stage(const std::string& folder, const std::string& name) const {
    const Json run = json(folder + "/run.json");
    for (const Json& stage : run.at("stages"))
      if (stage.at("name") == name) return stage;
    return nullptr;
  }

  Sample sample_;
};

/// What the folder of a run must hold, file by file.
constexpr std::array kFiles = {
    "info.json",           "calibrated.toml",      "calibration.json", "nominal.csv",
    "nominal.json",        "odometry.csv",         "odometry.json",    "slip.csv",
    "slip.json",           "trajectory.csv",       "localization.csv", "localization.json",
    "slam/trajectory.csv", "slam/online.csv",      "slam/slam.json",   "slam/landmarks.csv",
    "slam/steps.csv",      "slam/innovations.csv", "slam/growth.json", "slam/landmarks_covariance.csv"};

TEST_F(RunCommand, SlipIsLearnedFromAFolderOfRecordings) {
  const std::string tour = (kDemo / "session_01/tour").string();
  const Outcome outcome =
      run({"slip", tour, "--robot", kDemoRobot, "--learn", (kDemo / "session_02").string()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::HasSubstr("learned from"));
}

TEST_F(RunCommand, GivesTheBytesOfTheSingleCommandsInTurn) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const std::string tour = (kDemo / "session_01/tour").string();
  const std::string squares = (kDemo / "session_02").string();
  const std::string clean = (kDemo / "session_02/tour").string();
  ASSERT_EQ(
      run({"run", tour, "--robot", kDemoRobot, "--calibrate-on", squares, "--learn", clean, "-o", "d"}).err,
      "");
  std::map<std::string, std::string> in_one_go;
  for (const char* file : kFiles) in_one_go[file] = read(std::string("d/") + file);
  const Json evaluation = json("d/evaluation.json");

  std::filesystem::remove_all(sample_.folder() / "d");
  const auto printed_into = [&](const std::string& file, Arguments arguments) {
    arguments.emplace_back("--json");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    keep(file, outcome.out);
  };
  printed_into("d/info.json", {"info", tour, "--robot", kDemoRobot, "--gyro-noise"});
  run({"calibrate", squares, "--hold-out", tour, "--robot", kDemoRobot, "-o", "d/calibrated.toml"});
  printed_into("d/nominal.json", {"odometry", tour, "--robot", kDemoRobot, "-o", "d/nominal.csv"});
  printed_into("d/odometry.json", {"odometry", tour, "--robot", "d/calibrated.toml", "-o", "d/odometry.csv"});
  printed_into("d/slip.json", {"slip", tour, "--robot", "d/calibrated.toml", "--learn", clean, "-o",
                               "d/slip.csv", "--corrected", "d/trajectory.csv"});
  printed_into("d/localization.json",
               {"localize", tour, "--robot", "d/calibrated.toml", "--map", tour + "/landmarks.csv",
                "--correct-slip", "--learn", clean, "-o", "d/localization.csv"});
  printed_into("d/slam/slam.json", {"slam", tour, "--robot", "d/calibrated.toml", "--correct-slip", "--learn",
                                    clean, "--smooth", "-o", "d/slam"});
  for (const char* file : kFiles) EXPECT_EQ(read(std::string("d/") + file), in_one_go[file]) << file;

  for (const Json& trajectory : evaluation.at("trajectories"))
    for (const auto& [alignment, document] : trajectory.at("evaluations").items()) {
      const Outcome outcome = run({"evaluate", "d/" + trajectory.at("file").get<std::string>(), tour,
                                   "--robot", "d/calibrated.toml", "--align", alignment, "--json"});
      EXPECT_EQ(Json::parse(outcome.out), document) << trajectory.at("name") << " " << alignment;
    }
}

TEST_F(RunCommand, ASessionEndsWithALineForEachRunAndTheWhole) {
  for (const char* name : {"cw", "ccw"})
    for (const char* file : {"wheels.csv", "reference.csv"})
      keep(std::string("pair/log_") + name + "_" + file, read(std::string(name) + "/" + file));
  keep("pair/recording.toml", R"([wheels]
file = "log_*_wheels.csv"
columns = { time_s = "time_s", left_ticks = "left_ticks", right_ticks = "right_ticks" }
[reference]
file = "log_*_reference.csv"
columns = { time_s = "time_s", x_m = "x_m", y_m = "y_m", heading_rad = "heading_rad" }
)");
  const Outcome outcome = run({"run", "pair", "--robot", "nominal.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              testing::ContainsRegex(
                  "\nccw  position error, rms, start-aligned: nominal .*"
                  "\ncw   position error, rms, start-aligned: nominal .*"
                  "\nall  position error, rms of the runs' rms, start-aligned: nominal [0-9.]+ m .2 runs."));
  EXPECT_EQ(stage("d", "evaluation").at("status"), "done");
  EXPECT_TRUE(exists("d/cw/odometry.csv"));

  const std::string overview = run({"info", "pair"}).out;
  EXPECT_THAT(overview, HasSubstr("2 recordings (all of each: --verbose)"));
  EXPECT_LT(std::ranges::count(overview, '\n'), 5);
  EXPECT_THAT(run({"info", "pair", "--verbose"}).out, HasSubstr("wheels "));
}

/// The rows of a table with stamps, these moved.
std::string with_stamps_moved(const std::string& csv, double by_s) {
  std::istringstream lines(csv);
  std::string moved, line;
  while (std::getline(lines, line)) {
    const bool is_row = !line.empty() && std::isdigit(static_cast<unsigned char>(line.front())) != 0;
    const std::size_t end = line.find(',');
    moved += is_row ? fmt::format("{:.6f}{}\n", std::stod(line) + by_s, line.substr(end)) : line + "\n";
  }
  return moved;
}

TEST_F(RunCommand, TheReferenceOfATourWithSightingsIsMovedWhereItsClockIsItsOwn) {
  std::filesystem::copy(kDemo / "session_01/tour", sample_.folder() / "late",
                        std::filesystem::copy_options::recursive);
  keep("late/reference.csv", with_stamps_moved(read("late/reference.csv"), 0.6));
  const Outcome outcome = run(
      {"run", "late", "--robot", kDemoRobot, "--calibrate-on", (kDemo / "session_02").string(), "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(stage("d", "evaluation").at("remarks").dump(),
              HasSubstr("corrected: reference.time_offset_s -0.6"));
  const Json evaluation = json("d/evaluation.json");
  for (const Json& trajectory : evaluation.at("trajectories"))
    if (trajectory.at("name") == "odometry") {
      const Json& document = trajectory.at("evaluations").at("start");
      EXPECT_LT(document.at("position_m").at("rms").get<double>(), 0.05);
      EXPECT_EQ(
          Json::parse(
              run({"evaluate", "d/odometry.csv", "late", "--robot", "d/calibrated.toml", "--json"}).out),
          document);
    }
}

TEST_F(RunCommand, ASensorThatIsRecordedAndNotUsedIsNamed) {
  std::string robot = read(kDemoRobot);
  const std::size_t gyro = robot.find("[gyro]");
  ASSERT_NE(gyro, std::string::npos);
  robot.erase(gyro, robot.find('[', gyro + 1) - gyro);
  keep("gyroless.toml", robot);
  const Outcome outcome =
      run({"run", (kDemo / "session_02/straight").string(), "--robot", "gyroless.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(stage("d", "health check").at("remarks").dump(), HasSubstr("[gyro] in the robot file"));
}

TEST_F(RunCommand, StagesThatCannotRunSayWhyAndTheRestGoesOn) {
  const Outcome outcome = run({"run", "blind", "--robot", "nominal.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(stage("d", "odometry").at("status"), "done");
  for (const char* name : {"calibration", "slip", "slam", "evaluation"}) {
    EXPECT_NE(stage("d", name).at("status"), "done") << name;
    EXPECT_THAT(stage("d", name).at("message").get<std::string>(), testing::Not(IsEmpty())) << name;
    EXPECT_THAT(stage("d", name).at("outputs"), IsEmpty()) << name;
  }
  EXPECT_EQ(read("d/trajectory.csv"), read("d/odometry.csv"));
  EXPECT_FALSE(exists("d/nominal.csv"));
}

TEST_F(RunCommand, LocalizesOnTheMapThatItIsGiven) {
  const Outcome outcome = run({"run", "seen", "--robot", "sighted.toml", "--map", "map.csv", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(stage("d", "localization").at("status"), "done");
  const std::string in_one_go = read("d/localization.csv");
  EXPECT_EQ(run({"localize", "seen", "--robot", "d/calibrated.toml", "--map", "map.csv", "-o",
                 "d/localization.csv"})
                .exit_code,
            0);
  EXPECT_EQ(read("d/localization.csv"), in_one_go);

  ASSERT_EQ(run({"run", "seen", "--robot", "sighted.toml", "-o", "d"}).exit_code, 0);
  EXPECT_EQ(stage("d", "localization").at("status"), "skipped");
  EXPECT_FALSE(exists("d/localization.csv"));
  ASSERT_EQ(run({"run", "seen", "--robot", "sighted.toml", "--map", "other_map.csv", "-o", "d"}).exit_code,
            0);
  EXPECT_EQ(stage("d", "localization").at("status"), "failed");
  EXPECT_EQ(run({"run", "seen", "--robot", "sighted.toml", "--map", "nowhere.csv", "-o", "d"}).exit_code, 3);
}

TEST_F(RunCommand, TellsTheFiltersEstimateAndTheSmoothedOne) {
  ASSERT_EQ(run({"run", "seen", "--robot", "sighted.toml", "--filter", "fastslam2", "-o", "d"}).exit_code, 0);
  EXPECT_THAT(stage("d", "slam").at("message").get<std::string>(), HasSubstr("smoothed"));
  EXPECT_EQ(json("d/slam/slam.json").at("trajectory"), "smoothed");
  std::map<std::string, std::string> files;
  const Json told = json("d/run.json");
  for (const Json& trajectory : told.at("trajectories")) files[trajectory.at("name")] = trajectory.at("file");
  EXPECT_EQ(files["slam online"], "slam/online.csv");
  EXPECT_EQ(files["slam path"], "slam/path.csv");
  EXPECT_EQ(files["slam"], "slam/trajectory.csv");
  EXPECT_NE(read("d/slam/online.csv"), read("d/slam/trajectory.csv"));
}

/// The sightings of a recording without the names.
std::string unidentified(const std::string& sightings) {
  std::istringstream lines(sightings);
  std::string line, text;
  for (bool head = true; std::getline(lines, line); head = false) {
    const auto first = line.find(','), second = line.find(',', first + 1);
    text += (head ? line : line.substr(0, first + 1) + line.substr(second)) + "\n";
  }
  return text;
}

TEST_F(RunCommand, FindsOutWhichLandmarkIsWhichWhereNamesAreMissing) {
  const std::filesystem::path tour = kDemo / "session_01/tour";
  for (const char* file : {"wheels.csv", "gyro.csv"})
    keep(std::string("unidentified/") + file, read_file(tour / file));
  keep("unidentified/sightings.csv", unidentified(read_file(tour / "sightings.csv")));
  ASSERT_EQ(run({"run", "unidentified", "--robot", kDemoRobot, "-o", "d"}).exit_code, 0);
  ASSERT_EQ(stage("d", "slam").at("status"), "done") << stage("d", "slam").at("message");
  EXPECT_THAT(stage("d", "slam").at("message").get<std::string>(), HasSubstr("smoothed"));
  const std::string in_one_go = read("d/slam/trajectory.csv");
  ASSERT_EQ(run({"slam", "unidentified", "--robot", "d/calibrated.toml", "--correct-slip", "--smooth", "-o",
                 "d/slam"})
                .exit_code,
            0);
  EXPECT_EQ(read("d/slam/trajectory.csv"), in_one_go);
}

/// One sighting of a landmark that may be any leaves too much open.
TEST_F(RunCommand, WhatCannotBeSmoothedIsFilteredAllTheSame) {
  ASSERT_EQ(run({"run", "unnamed", "--robot", "sighted.toml", "-o", "d"}).exit_code, 0);
  ASSERT_EQ(stage("d", "slam").at("status"), "done") << stage("d", "slam").at("message");
  EXPECT_EQ(json("d/slam/slam.json").at("trajectory"), "online estimate");
  EXPECT_FALSE(exists("d/slam/online.csv"));
}

TEST_F(RunCommand, OdometrySaysWhichSizesNoCalibrationMeasured) {
  ASSERT_EQ(run({"calibrate", "cw", "ccw", "--robot", "nominal.toml", "--fix", "left.diameter", "--fix",
                 "right.diameter", "-o", "c.toml"})
                .exit_code,
            0);
  const Outcome outcome = run({"odometry", "cw", "--robot", "c.toml", "-o", "t.csv"});
  EXPECT_THAT(outcome.out, testing::HasSubstr("taken as exact"));
  EXPECT_THAT(outcome.out, testing::HasSubstr("left.diameter, right.diameter"));
}

TEST_F(RunCommand, OutputsThatStagesNameAreThere) {
  ASSERT_EQ(run({"run", "ccw", "--robot", "nominal.toml", "-o", "d"}).exit_code, 0);
  const Json run_json = json("d/run.json");
  for (const Json& stage : run_json.at("stages"))
    for (const Json& output : stage.at("outputs"))
      EXPECT_TRUE(exists("d/" + output.get<std::string>())) << output;
  for (const Json& trajectory : run_json.at("trajectories"))
    EXPECT_TRUE(exists("d/" + trajectory.at("file").get<std::string>())) << trajectory;
}

/// What the page draws over time stands in the files of the stages.
TEST_F(RunCommand, WritesBiasAndStatisticOverTime) {
  const std::string tour = (kDemo / "session_01/tour").string();
  ASSERT_EQ(run({"run", tour, "--robot", kDemoRobot, "-o", "d"}).exit_code, 0);
  const Json bias = json("d/odometry.json").at("gyro_bias_over_time");
  ASSERT_GT(bias.at("time_s").size(), 10);
  EXPECT_EQ(bias.at("rad_s").size(), bias.at("time_s").size());
  EXPECT_EQ(bias.at("rad_s").back(), json("d/odometry.json").at("gyro_bias").at("rad_s"));
  EXPECT_LT(bias.at("sigma_rad_s").back(), bias.at("sigma_rad_s").front());
  const Json slip = json("d/slip.json");
  EXPECT_EQ(slip.at("timeline").at("value").size(), slip.at("timeline").at("end_s").size());
  for (std::size_t i = 0; i < slip.at("timeline").at("value").size(); ++i)
    EXPECT_EQ(slip.at("timeline").at("value")[i].is_number(),
              slip.at("timeline").at("status")[i] == "judged");
}

/// Drawn from what the stages gave, it is the page that `trundle report` draws from their files.
TEST_F(RunCommand, ThePageIsTheSameFromMemoryAndFromTheFolder) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const std::string slip = (kDemo / "slip").string(), squares = (kDemo / "session_01").string();
  for (const Arguments& line :
       {Arguments{"run", slip, "--robot", kDemoRobot, "--calibrate-on", squares, "-o", "d"},
        Arguments{"run", "ccw", "--robot", "nominal.toml", "-o", "d"},
        Arguments{"run", "unnamed", "--robot", "sighted.toml", "-o", "d"},
        Arguments{"run", "blind", "--robot", "nominal.toml", "-o", "d"}}) {
    ASSERT_EQ(run(line).exit_code, 0);
    ASSERT_EQ(run({"report", "d", "-o", "again.html"}).exit_code, 0);
    EXPECT_TRUE(read("d/report.html") == read("again.html")) << line[1];
  }
}

TEST_F(RunCommand, ACalibratedRobotIsTakenAsItIs) {
  ASSERT_EQ(run({"run", "ccw", "--robot", "nominal.toml", "-o", "d"}).exit_code, 0);
  EXPECT_EQ(json("d/run.json").at("held_out"), false);
  ASSERT_EQ(run({"run", "cw", "--robot", "d/calibrated.toml", "-o", "e"}).exit_code, 0);
  EXPECT_EQ(stage("e", "calibration").at("status"), "skipped");
  EXPECT_TRUE(json("e/run.json").at("held_out").is_null());
  ASSERT_EQ(run({"run", "cw", "--robot", "d/calibrated.toml", "--calibrate-on", "ccw", "-o", "f"}).exit_code,
            0);
  EXPECT_EQ(stage("f", "calibration").at("status"), "done");
  EXPECT_EQ(json("f/run.json").at("held_out"), true);
}

TEST_F(RunCommand, AResultHoldsNothingOfTheRunBeforeIt) {
  ASSERT_EQ(run({"run", "ccw", "--robot", "nominal.toml", "-o", "d"}).exit_code, 0);
  ASSERT_TRUE(exists("d/calibrated.toml"));
  ASSERT_EQ(run({"run", "blind", "--robot", "nominal.toml", "-o", "d"}).exit_code, 0);
  EXPECT_FALSE(exists("d/calibrated.toml"));
  EXPECT_FALSE(exists("d/evaluation.json"));
}

TEST_F(RunCommand, ASessionIsCalibratedAsAWholeAndItsRecordingsOneByOne) {
  for (const char* name : {"cw", "ccw"})
    for (const char* file : {"wheels.csv", "reference.csv"})
      keep(std::string("both/") + name + "/" + file, read(std::string(name) + "/" + file));
  const Outcome outcome = run({"run", "both", "--robot", "nominal.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* name : {"health check", "calibration", "report"})
    EXPECT_EQ(stage("d", name).at("status"), "done") << stage("d", name).at("message");
  EXPECT_EQ(json("d/run.json").at("recordings"), Json({"ccw", "cw"}));
  for (const char* one : {"d/cw", "d/ccw"}) {
    EXPECT_EQ(stage(one, "report").at("status"), "done") << stage(one, "report").at("message");
    EXPECT_EQ(stage(one, "calibration").at("status"), "skipped");
  }
}

TEST_F(RunCommand, OneDriveUnderTwoNamesIsNamed) {
  std::filesystem::copy(sample_.folder() / "cw", sample_.folder() / "again");
  const Outcome twice = run({"calibrate", "cw", "again", "--hold-out", "cw", "--robot", "nominal.toml"});
  EXPECT_EQ(twice.exit_code, 0) << twice.err;
  EXPECT_THAT(twice.out, HasSubstr("again hold the same data: it counts twice"));
  EXPECT_THAT(twice.out, HasSubstr("cw is held out and learned from: its error is that of training"));
  const Outcome other = run({"calibrate", "cw", "--hold-out", "ccw", "--robot", "nominal.toml"});
  EXPECT_THAT(other.out, testing::Not(testing::AnyOf(HasSubstr("same data"), HasSubstr("held out and"))));
}

TEST_F(RunCommand, AnErrorOfTrainingIsNotCalledHeldOut) {
  const Outcome same = run({"run", "cw", "--robot", "nominal.toml", "--calibrate-on", "cw", "-o", "d"});
  EXPECT_THAT(same.out, HasSubstr("warning: cw is held out and learned from"));
  EXPECT_FALSE(json("d/run.json").at("held_out").get<bool>());
  run({"run", "cw", "--robot", "nominal.toml", "--calibrate-on", "ccw", "-o", "d"});
  EXPECT_TRUE(json("d/run.json").at("held_out").get<bool>());
}

TEST_F(RunCommand, NothingAnsweredIsExitCodeFourAndChangesNothing) {
  keep("one_wheel.toml",
       "name = \"one\"\n[[wheel]]\nname = \"left\"\ndiameter_m = 0.1\nticks_per_revolution = 100\n");
  ASSERT_EQ(run({"run", "blind", "--robot", "nominal.toml", "-o", "d"}).exit_code, 0);
  const auto before = files_below(sample_.folder() / "d");
  const Outcome outcome = run({"run", "blind", "--robot", "one_wheel.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.out, HasSubstr("odometry       failed"));
  EXPECT_EQ(files_below(sample_.folder() / "d"), before);
  EXPECT_EQ(run({"run", "blind", "--robot", "one_wheel.toml", "-o", "new"}).exit_code, 4);
  EXPECT_FALSE(exists("new"));
}

TEST_F(RunCommand, EvaluateNamesEachFileOfAReferenceFolderAndWhatItIsKnownTo) {
  const std::string tour = (kDemo / "session_01/tour").string();
  ASSERT_EQ(run({"odometry", tour, "--robot", kDemoRobot, "-o", "t.csv"}).exit_code, 0);
  const Json told = Json::parse(run({"evaluate", "t.csv", tour, "--json"}).out);
  std::vector<std::string> names;
  for (const Json& input : told.at("inputs")) {
    names.push_back(std::filesystem::path(input.at("path").get<std::string>()).filename());
    EXPECT_EQ(input.at("sha256").get<std::string>().size(), 64) << input;
  }
  EXPECT_THAT(names, testing::ElementsAre("t.csv", "recording.toml", "reference.csv"));
  EXPECT_EQ(told.at("reference_noise").at("position_sigma_m"), 0.001);
  EXPECT_THAT(run({"evaluate", "t.csv", tour}).out,
              HasSubstr("the reference's own 0.001 m and 0.1 deg are counted"));
  EXPECT_THAT(run({"evaluate", "t.csv", tour + "/reference.csv"}).out,
              HasSubstr("the reference is taken as exact"));
}

TEST_F(RunCommand, CtrlCLeavesTheResultsBeforeOrThoseAfterAndNothingElse) {
  const auto line = [](const char* recording) {
    return Arguments{"run", recording, "--robot", "sighted.toml", "-o", "in/d"};
  };
  const auto results_of = [&](const char* recording) {
    EXPECT_EQ(run(line(recording)).exit_code, 0);
    return files_below(sample_.folder() / "in");
  };
  const auto after = results_of("seen");
  const auto before = results_of("blind");
  // A run may come from its first stage to its end between two delays: then again, in smaller steps.
  int cut_short = 0;
  for (int round = 0; round < 10 && cut_short == 0; ++round) {
    ASSERT_TRUE(results_of("blind") == before);
    for (int delay_us = 2'000; delay_us < 20'000'000; delay_us += delay_us / (4 * (round + 1))) {
      const Outcome outcome =
          run_program(sample_.folder(), line("seen"),
                      {.ended_after = std::chrono::microseconds(delay_us), .signal = SIGINT});
      const auto left = files_below(sample_.folder() / "in");
      ASSERT_TRUE(left == before || left == after) << "after " << delay_us << " µs";
      if (left == after) break;
      cut_short += outcome.out.empty() ? 0 : 1;
    }
  }
  EXPECT_GT(cut_short, 0) << "no run was interrupted between its first stage and its last";
}

TEST_F(RunCommand, ASecondOneIntoTheSameFolderIsRefused) {
  const ResultFolder first(sample_.folder() / "d");
  const Outcome outcome = run({"run", "ccw", "--robot", "nominal.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, HasSubstr("d: is in use by another run"));
}

TEST_F(RunCommand, ASessionBeforeItLeavesNothingEither) {
  for (const char* name : {"cw", "ccw"})
    for (const char* file : {"wheels.csv", "reference.csv"})
      keep(std::string("both/") + name + "/" + file, read(std::string(name) + "/" + file));
  ASSERT_EQ(run({"run", "both", "--robot", "nominal.toml", "-o", "d"}).exit_code, 0);
  ASSERT_TRUE(exists("d/cw/run.json"));
  keep("d/cw/notes.txt", "mine");
  ASSERT_EQ(run({"run", "blind", "--robot", "nominal.toml", "-o", "d"}).exit_code, 0);
  EXPECT_FALSE(exists("d/ccw"));
  EXPECT_FALSE(exists("d/cw/run.json"));
  EXPECT_TRUE(exists("d/cw/notes.txt"));
}

TEST_F(RunCommand, AFileThatMayNotGrowIsAnErrorAndLeavesNothing) {
  const std::string line = " run ccw --robot nominal.toml -o d";
  const Outcome outcome =
      run_program(sample_.folder(), {"-c", "ulimit -f 8; " TRUNDLE_PROGRAM + line}, {.program = "/bin/bash"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_FALSE(exists("d"));
}

TEST_F(RunCommand, SlamLeavesNoFileOfAnotherFilter) {
  ASSERT_EQ(run({"slam", "seen", "--robot", "sighted.toml", "--filter", "fastslam2", "-o", "o"}).exit_code,
            0);
  ASSERT_TRUE(exists("o/path.csv"));
  keep("o/notes.txt", "mine");
  ASSERT_EQ(run({"slam", "seen", "--robot", "sighted.toml", "--filter", "ekf", "-o", "o"}).exit_code, 0);
  EXPECT_FALSE(exists("o/path.csv"));
  EXPECT_FALSE(exists("o/particles.csv"));
  EXPECT_TRUE(exists("o/landmarks_covariance.csv"));
  EXPECT_TRUE(exists("o/notes.txt"));
}

// With hardly any weight on the distance an estimate of the track leads nowhere; that ended in an assertion.
TEST_F(RunCommand, ATrackThatTheDataDoNotShowIsToldByCalibrate) {
  for (const char* file : {"wheels.csv", "gyro.csv"})
    keep(std::string("vague/") + file, read_file(kDemo / "session_01/straight" / file));
  keep("vague/recording.toml", "[reference]\ndistance_m = 2\ndistance_m_sigma = 1e9\n");
  const Outcome outcome = run({"calibrate", "vague", "--robot", kDemoRobot, "-o", "c.toml"});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_FALSE(exists("c.toml"));
}

TEST_F(RunCommand, WrongInputIsExitCodeThree) {
  EXPECT_EQ(run({"run", "nowhere", "--robot", "nominal.toml", "-o", "d"}).exit_code, 3);
  EXPECT_EQ(run({"run", "ccw", "--robot", "nowhere.toml", "-o", "d"}).exit_code, 3);
  EXPECT_FALSE(exists("d"));
}

/// The file is one of the run, opens as a log, and goes with the next run that is not asked for it.
TEST_F(RunCommand, WritesWhatViewersRead) {
  for (const std::string format : {"mcap", "wpilog"}) {
    ASSERT_EQ(run({"run", "seen", "--robot", "sighted.toml", "--export", format, "-o", "out"}).exit_code, 0);
    EXPECT_EQ(stage("out", "export").at("outputs"), Json::array({"run." + format}));
    EXPECT_EQ(json("out/run.json").at("options").at("export"), format);
    const Outcome info = run({"info", "out/run." + format});
    EXPECT_EQ(info.exit_code, 0) << info.err;
    for (const char* what : {"rundle/odometry", "andmarks"}) EXPECT_THAT(info.out, HasSubstr(what));
    EXPECT_EQ(exists("out/run.mcap"), format == "mcap");
  }
  ASSERT_EQ(run({"run", "seen", "--robot", "sighted.toml", "-o", "out"}).exit_code, 0);
  EXPECT_FALSE(exists("out/run.wpilog"));
  EXPECT_TRUE(stage("out", "export").is_null());
}

TEST_F(RunCommand, SingleCommandsWriteWhatViewersReadBesideTheirResults) {
  ASSERT_EQ(run({"odometry", "seen", "--robot", "sighted.toml", "--export", "mcap", "-o", "t.csv"}).exit_code,
            0);
  EXPECT_THAT(run({"info", "t.mcap"}).out, HasSubstr("nav_msgs/msg/Odometry"));
  ASSERT_EQ(run({"slam", "seen", "--robot", "sighted.toml", "--export", "wpilog", "-o", "map"}).exit_code, 0);
  EXPECT_THAT(run({"info", "map/slam.wpilog"}).out, HasSubstr("/Trundle/slam online/Pose"));
  EXPECT_EQ(run({"odometry", "seen", "--robot", "sighted.toml", "--export", "mcap"}).exit_code, 2);
}

}  // namespace
}  // namespace trundle::test
