// What every command promises its users: interfaces in docs/commands.md. A new command is one line in
// kCommands.
#include <algorithm>
#include <cmath>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/chassis/robot.hpp"
#include "trundle/io/file.hpp"
#include "trundle/slam/slam.hpp"
#include "trundle/statistics/random.hpp"

#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

/// A command with arguments that succeed in the folder of a Sample.
struct Command {
  std::string name;
  Arguments arguments;    ///< the first names an input
  Arguments outputs;      ///< files it writes
  Arguments before = {};  ///< a command line that makes its inputs
};

const std::vector<Command> kCommands = {
    {"calibrate",
     {"cw", "ccw", "--robot", "nominal.toml", "-o", "out/calibrated.toml"},
     {"out/calibrated.toml", "out/calibration.json"}},
    {"umbmark",
     {"sheet.csv", "--robot", "nominal.toml", "-o", "out/calibrated.toml"},
     {"out/calibrated.toml", "out/calibration.json"}},
    {"install-angle", {"l_run", "--robot", "pods.toml"}, {}},
    {"odometry", {"ccw", "--robot", "nominal.toml", "-o", "out/trajectory.csv"}, {"out/trajectory.csv"}},
    {"slip",
     {"slippery", "--robot", "with_gyro.toml", "-o", "out/slip.csv", "--corrected", "out/trajectory.csv"},
     {"out/slip.csv", "out/trajectory.csv"},
     {"simulate", "slippery.toml", "-o", "slippery"}},
    {"slam",
     {"seen", "--robot", "sighted.toml", "-o", "out/slam"},
     {"out/slam/trajectory.csv", "out/slam/landmarks.csv", "out/slam/landmarks_covariance.csv",
      "out/slam/steps.csv", "out/slam/innovations.csv", "out/slam/slam.json"}},
    {"merge",
     {"map", "map", "-o", "out/merged"},
     {"out/merged/landmarks.csv", "out/merged/landmarks_covariance.csv", "out/merged/merge.json"},
     {"slam", "seen", "--robot", "sighted.toml", "--smooth", "-o", "map"}},
    {"localize",
     {"seen", "--robot", "sighted.toml", "--map", "map.csv", "-o", "out/trajectory.csv"},
     {"out/trajectory.csv"}},
    {"evaluate", {"cw/reference.csv", "ccw/reference.csv", "--align", "se2"}, {}},
    {"simulate",
     {"scenario.toml", "-o", "out/simulated"},
     {"out/simulated/wheels.csv", "out/simulated/reference.csv"}},
    {"info", {"ccw", "--robot", "nominal.toml"}, {}},
    {"init", {"ccw", "-o", "out/draft"}, {"out/draft/robot.toml", "out/draft/recording.toml"}},
    {"run",
     {"ccw", "--robot", "nominal.toml", "-o", "out/run"},
     {"out/run/info.json", "out/run/calibrated.toml", "out/run/calibration.json", "out/run/nominal.csv",
      "out/run/odometry.csv", "out/run/odometry.json", "out/run/trajectory.csv", "out/run/evaluation.json",
      "out/run/report.html"}},
    {"report",
     {"calibrated", "-o", "out/report.html"},
     {"out/report.html"},
     {"calibrate", "cw", "ccw", "--robot", "nominal.toml", "-o", "calibrated/calibrated.toml"}},
};

void PrintTo(const Command& command, std::ostream* stream) {
  *stream << command.name;
}

/// Names of tests hold no hyphens.
std::string test_name(const Command& command) {
  std::string name = command.name;
  std::ranges::replace(name, '-', '_');
  return name;
}

Arguments command_line(const Command& command, const Arguments& more = {}) {
  Arguments line = {command.name};
  line.insert(line.end(), command.arguments.begin(), command.arguments.end());
  line.insert(line.end(), more.begin(), more.end());
  return line;
}

class Contract : public testing::TestWithParam<Command> {
 protected:
  void SetUp() override {
    if (GetParam().before.empty()) return;
    ASSERT_EQ(run(GetParam().before).exit_code, 0);
  }
  Outcome run(const Arguments& arguments) const { return run_program(sample_.folder(), arguments); }
  std::vector<std::string> outputs() const {
    std::vector<std::string> contents;
    for (const std::string& output : GetParam().outputs)
      contents.push_back(read_file(sample_.folder() / output));
    return contents;
  }

  Sample sample_;
};

TEST(Slam, EveryFilterDoesWithoutNames) {
  const Sample sample;
  for (const std::string& filter : slam_method_names()) {
    const Outcome outcome = run_program(sample.folder(), {"slam", "unnamed", "--robot", "sighted.toml",
                                                          "--filter", filter, "--unknown-ids", "-o", "out"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_GT(std::ranges::count(read_file(sample.folder() / "out" / "landmarks.csv"), '\n'), 2);
  }
}

TEST_P(Contract, HelpShowsAnExample) {
  const Outcome outcome = run({GetParam().name, "--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, IsEmpty());
  EXPECT_THAT(outcome.out, HasSubstr("Example:\n  trundle " + GetParam().name + " "));
  EXPECT_THAT(outcome.out, HasSubstr("--json"));
  EXPECT_THAT(outcome.out, HasSubstr("--quiet"));
}

TEST_P(Contract, SaysSomethingAndNoError) {
  const Outcome outcome = run(command_line(GetParam()));
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.err, IsEmpty());
  EXPECT_THAT(outcome.out, testing::Not(IsEmpty()));
}

TEST_P(Contract, PrintsTheSameAgain) {
  const std::string first = run(command_line(GetParam())).out;
  EXPECT_EQ(run(command_line(GetParam())).out, first);
}

TEST_P(Contract, SaysWhenStdoutIsFull) {
  std::string command = TRUNDLE_PROGRAM;
  for (const std::string& argument : command_line(GetParam())) command += " '" + argument + "'";
  const Outcome outcome =
      run_program(sample_.folder(), {"-c", command + " > /dev/full"}, {.program = "/bin/sh"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
}

TEST_P(Contract, JsonIsOneDocument) {
  const Outcome outcome = run(command_line(GetParam(), {"--json"}));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.err, IsEmpty());
  EXPECT_TRUE(nlohmann::json::accept(outcome.out)) << outcome.out;
}

TEST_P(Contract, JsonNamesVersionInputsAndOptions) {
  const auto document = nlohmann::json::parse(run(command_line(GetParam(), {"--json"})).out);
  const auto& provenance = document.contains("provenance") ? document.at("provenance") : document;
  EXPECT_EQ(provenance.at("program"), "trundle");
  EXPECT_FALSE(provenance.at("version").empty());
  EXPECT_TRUE(provenance.contains("options"));
  ASSERT_FALSE(provenance.at("inputs").empty());
  for (const auto& input : provenance.at("inputs"))
    EXPECT_EQ(input.at("sha256").get<std::string>().size(), 64U);
}

TEST_P(Contract, QuietIsQuiet) {
  const Outcome outcome = run(command_line(GetParam(), {"--quiet"}));
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out + outcome.err, IsEmpty());
}

TEST_P(Contract, SameInputsGiveTheSameBytes) {
  const Outcome first = run(command_line(GetParam(), {"--json"}));
  const std::vector<std::string> first_outputs = outputs();
  std::filesystem::remove_all(sample_.folder() / "out");
  const Outcome second = run(command_line(GetParam(), {"--json"}));
  EXPECT_EQ(first.out, second.out);
  EXPECT_EQ(first_outputs, outputs());
}

TEST_P(Contract, AMissingInputIsNamedInOneLine) {
  Command command = GetParam();
  command.arguments.front() = "no_such_input.csv";
  const Outcome outcome = run(command_line(command));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, HasSubstr("no_such_input.csv"));
  EXPECT_FALSE(std::filesystem::exists(sample_.folder() / "out"));
}

TEST_P(Contract, UsageErrorsAreOneLineAndExitWith2) {
  for (const Arguments& wrong :
       {command_line(GetParam(), {"--no-such-option"}), Arguments{GetParam().name}}) {
    const Outcome outcome = run(wrong);
    EXPECT_EQ(outcome.exit_code, 2) << wrong.back();
    EXPECT_THAT(outcome.out, IsEmpty()) << wrong.back();
    EXPECT_THAT(outcome.err, IsOneLineOfError()) << wrong.back();
  }
}

class Writing : public Contract {};

TEST_P(Writing, AnOutputThatCannotBeWrittenIsBadInput) {
  Command command = GetParam();
  *std::next(std::ranges::find(command.arguments, "-o")) = "nominal.toml/below_a_file";
  const Outcome outcome = run(command_line(command));
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, HasSubstr("nominal.toml"));
}

TEST_P(Writing, AKilledRunLeavesOldOutputsOrNewOnes) {
  ASSERT_EQ(run(command_line(GetParam())).exit_code, 0);
  const std::vector<std::string> complete = outputs();
  for (int delay_us = 500; delay_us < 50'000; delay_us = delay_us * 5 / 4) {
    for (const std::string& output : GetParam().outputs) write_file(sample_.folder() / output, "old");
    run_program(sample_.folder(), command_line(GetParam()), std::chrono::microseconds(delay_us));
    const std::vector<std::string> left = outputs();
    for (std::size_t i = 0; i < left.size(); ++i)
      EXPECT_TRUE(left[i] == "old" || left[i] == complete[i])
          << GetParam().outputs[i] << " after " << delay_us;
  }
}

INSTANTIATE_TEST_SUITE_P(, Contract, testing::ValuesIn(kCommands),
                         [](const auto& test) { return test_name(test.param); });

std::vector<Command> writing_commands() {
  std::vector<Command> commands;
  std::ranges::copy_if(kCommands, std::back_inserter(commands),
                       [](const Command& c) { return !c.outputs.empty(); });
  return commands;
}
INSTANTIATE_TEST_SUITE_P(, Writing, testing::ValuesIn(writing_commands()),
                         [](const auto& test) { return test_name(test.param); });

/// A command line, how it must end, and what its one line of error must say.
struct Failure {
  std::string name;
  Arguments arguments;
  int exit_code;
  std::string says;
};

const std::vector<Failure> kFailures = {
    {"NoCommand", {}, 2, "command"},
    {"UnknownCommand", {"calibrat"}, 2, "calibrat"},
    {"UnknownOption", {"--no-such-option"}, 2, "--no-such-option"},
    {"UnknownAlignment", {"evaluate", "cw/reference.csv", "cw/reference.csv", "--align", "sim3"}, 2, "sim3"},
    {"RobotFileThatIsNone", {"odometry", "cw", "--robot", "sheet.csv", "-o", "out/t.csv"}, 3, "sheet.csv:2"},
    {"FolderWithoutStreams", {"info", "empty"}, 3, "empty"},
    {"WrongParameterName",
     {"calibrate", "cw", "--robot", "nominal.toml", "--free", "trck", "-o", "out/c.toml"},
     3,
     "trck"},
    {"NothingToCalibrateWith",
     {"calibrate", "blind", "--robot", "nominal.toml", "-o", "out/c.toml"},
     4,
     "to calibrate with"},
    {"InstallAngleWithoutAnEnd", {"install-angle", "--side-m", "2"}, 2, "--end-x-m"},
    {"InstallAngleOfARepeatThatIsNone",
     {"install-angle", "--side-m", "2", "--end-x-m", "2", "--end-y-m", "2", "--repeat", "2;2"},
     2,
     "2;2"},
    {"InstallAngleOfRepeatsThatNobodyMeasured",
     {"install-angle", "--side-m", "2", "--end-x-m", "2", "--end-y-m", "2", "--repeat", "5"},
     2,
     "5 runs are said to be there, 1 given"},
    {"InstallAngleOfHalfAnEnd",
     {"install-angle", "--side-m", "2", "--end-x-m", "2", "--end-x-m", "2", "--end-y-m", "2"},
     2,
     "one of each for every run"},
    {"InstallAngleOfNoSide",
     {"install-angle", "--side-m", "0", "--end-x-m", "2", "--end-y-m", "2"},
     3,
     "0 m"},
    {"InstallAngleOfNoL",
     {"install-angle", "--side-m", "2", "--end-x-m", "2", "--end-y-m", "0"},
     4,
     "L-shaped"},
    {"InstallAngleOfADifferentialDrive",
     {"install-angle", "cw", "--robot", "nominal.toml"},
     3,
     "two passive wheels"},
    {"SlipThatNoReadingShows",
     {"slip", "cw", "--robot", "nominal.toml", "-o", "out/s.csv"},
     4,
     "slip is not observable"},
    {"UnknownSlipMethod", {"slip", "cw", "--robot", "nominal.toml", "--method", "best"}, 2, "best"},
    {"UnknownFilter", {"slam", "seen", "--robot", "sighted.toml", "--filter", "ukf", "-o", "out"}, 2, "ukf"},
    {"NoParticles",
     {"slam", "seen", "--robot", "sighted.toml", "--particles", "0", "-o", "out"},
     2,
     "--particles"},
    {"NoLandmarkSensor", {"slam", "seen", "--robot", "nominal.toml", "-o", "out"}, 3, "landmark_sensor"},
    {"NothingSeen", {"slam", "blind", "--robot", "sighted.toml", "-o", "out"}, 4, "no sightings"},
    {"SeveralRecordingsOfOneRobot",
     {"slam", "seen", "blind", "--robot", "sighted.toml", "-o", "out"},
     2,
     "--together"},
    {"TogetherAlone",
     {"slam", "seen", "--robot", "sighted.toml", "--together", "-o", "out"},
     2,
     "two robots"},
    {"TogetherWithoutOverlap",
     {"slam", "seen", "blind", "--robot", "sighted.toml", "--together", "-o", "out"},
     4,
     "no overlap"},
    {"TogetherWithACheckpoint",
     {"slam", "seen", "seen", "--robot", "sighted.toml", "--together", "--checkpoint", "c", "-o", "out"},
     2,
     "--checkpoint"},
    {"MergeOfAMapWithoutCovariances",
     {"merge", "map.csv", "map.csv", "-o", "out"},
     4,
     "no covariance of all"},
    {"MapThatIsNone",
     {"localize", "seen", "--robot", "sighted.toml", "--map", "sheet.csv", "-o", "out/t.csv"},
     3,
     "no column 'landmark'"},
    {"MapWithALandmarkTwice",
     {"localize", "seen", "--robot", "sighted.toml", "--map", "twice.csv", "-o", "out/t.csv"},
     3,
     "twice.csv:3"},
    {"NeverLocalized",
     {"localize", "seen", "--robot", "sighted.toml", "--map", "other_map.csv", "-o", "out/t.csv"},
     4,
     "name landmarks that the map does not have"},
    {"StartThatIsNoPose",
     {"localize", "seen", "--robot", "sighted.toml", "--map", "map.csv", "--start", "1,2", "-o", "out/t.csv"},
     2,
     "--start"},
    {"NothingInCommon", {"evaluate", "cw/reference.csv", "later.csv"}, 4, ""},
};

void PrintTo(const Failure& failure, std::ostream* stream) {
  *stream << failure.name;
}

class Fails : public testing::TestWithParam<Failure> {};

TEST_P(Fails, WithItsExitCodeAndOneLine) {
  const Sample sample;
  const Outcome outcome = run_program(sample.folder(), GetParam().arguments);
  EXPECT_EQ(outcome.exit_code, GetParam().exit_code);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, HasSubstr(GetParam().says));
  EXPECT_FALSE(std::filesystem::exists(sample.folder() / "out"));
}

INSTANTIATE_TEST_SUITE_P(, Fails, testing::ValuesIn(kFailures),
                         [](const auto& test) { return test.param.name; });

/// A minute of standing still, then a turn.
void write_parked(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  std::ofstream wheels(folder / "wheels.csv");
  std::ofstream gyro(folder / "gyro.csv");
  wheels << "time_s,left_ticks,right_ticks\n";
  gyro << "time_s,yaw_rate_rad_s\n";
  Random random(1);
  for (int k = 0; k <= 1300; ++k) {
    const double t = 0.05 * k;
    const int turned = std::max(0, k - 1200);
    wheels << t << "," << -64 * turned << "," << 64 * turned << "\n";
    gyro << t << "," << 0.01 + random.normal(0.003) + (turned > 0 ? 0.4 : 0.0) << "\n";
  }
}

TEST(Program, MeasuresTheGyroAtRestAndWritesItIntoTheRobotFile) {
  const Sample sample;
  write_parked(sample.folder() / "parked");
  const Outcome measured = run_program(sample.folder(), {"info", "parked", "--robot", "nominal.toml",
                                                         "--gyro-noise", "-o", "out/robot.toml", "--json"});
  ASSERT_EQ(measured.exit_code, 0) << measured.err;
  const auto noise = nlohmann::json::parse(measured.out).at("gyro_noise");
  EXPECT_NEAR(noise.at("noise_rad_s_sqrt_hz").get<double>(), 0.003 / std::sqrt(20.0), 1e-4);
  EXPECT_FALSE(noise.contains("bias_walk_rad_s_sqrt_s"));
  EXPECT_GT(noise.at("allan").size(), 5U);
  const std::string robot = read_file(sample.folder() / "out/robot.toml");
  EXPECT_THAT(robot, HasSubstr("# noise_rad_s_sqrt_hz: Allan deviation of"));
  EXPECT_THAT(robot, HasSubstr("# bias_walk_rad_s_sqrt_s: as it was: the rests are too short"));
  EXPECT_EQ(parse_robot(robot, "robot.toml").chassis.gyro->noise_rad_s_sqrt_hz,
            noise.at("noise_rad_s_sqrt_hz").get<double>());

  const Outcome integrated =
      run_program(sample.folder(), {"odometry", "parked", "--robot", "out/robot.toml", "--smooth", "--json"});
  ASSERT_EQ(integrated.exit_code, 0) << integrated.err;
  const auto odometry = nlohmann::json::parse(integrated.out);
  EXPECT_GT(odometry.at("rest_s").get<double>(), 58.0);
  EXPECT_NEAR(odometry.at("gyro_bias").at("rad_s").get<double>(), 0.01,
              4.0 * odometry.at("gyro_bias").at("sigma_rad_s").get<double>());
}

TEST(Program, WritesNoRobotFileWithoutBeingToldWhich) {
  const Sample sample;
  write_parked(sample.folder() / "parked");
  for (const Arguments& arguments :
       {Arguments{"info", "parked", "--gyro-noise", "-o", "out/robot.toml"},
        Arguments{"info", "parked", "--robot", "nominal.toml", "-o", "out/robot.toml"}}) {
    const Outcome outcome = run_program(sample.folder(), arguments);
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_THAT(outcome.err, IsOneLineOfError());
  }
}

std::vector<std::string> contents_of(const std::filesystem::path& folder) {
  std::vector<std::string> contents;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    contents.push_back(entry.path().filename().string() + "\n" + read_file(entry.path()));
  std::ranges::sort(contents);
  return contents;
}

Arguments slam_of(const std::string& recording, const std::string& filter, const Arguments& more) {
  Arguments line = {"slam", recording, "--robot", "sighted.toml", "--filter", filter, "--quiet"};
  line.insert(line.end(), more.begin(), more.end());
  return line;
}

TEST(Program, SlamGoesOnFromACheckpointAsIfNothingHadHappened) {
  const Sample sample;
  for (const std::string& filter : slam::slam_method_names()) {
    ASSERT_EQ(run_program(sample.folder(), slam_of("seen", filter, {"-o", "whole"})).exit_code, 0);
    const Outcome begun =
        run_program(sample.folder(),
                    slam_of("seen_half", filter,
                            {"--checkpoint", "slam.state", "--checkpoint-every-s", "0.3", "-o", "half"}));
    ASSERT_EQ(begun.exit_code, 0) << begun.err;
    const Outcome ended =
        run_program(sample.folder(), slam_of("seen", filter, {"--resume", "slam.state", "-o", "resumed"}));
    ASSERT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_EQ(contents_of(sample.folder() / "whole"), contents_of(sample.folder() / "resumed")) << filter;
  }
}

TEST(Program, SlamRefusesACheckpointThatIsNotItsOwn) {
  const Sample sample;
  ASSERT_EQ(
      run_program(sample.folder(), slam_of("seen", "ekf", {"--checkpoint", "slam.state", "-o", "first"}))
          .exit_code,
      0);
  write_file(sample.folder() / "short.state", read_file(sample.folder() / "slam.state").substr(0, 500));
  const std::vector<std::pair<Arguments, std::string>> wrong = {
      {slam_of("seen", "ekf", {"--resume", "short.state", "-o", "out"}), "cut short"},
      {slam_of("seen", "ekf", {"--resume", "sheet.csv", "-o", "out"}), "no checkpoint"},
      {slam_of("seen", "fastslam2", {"--resume", "slam.state", "-o", "out"}), "other options"},
      {slam_of("seen_half", "ekf", {"--resume", "slam.state", "-o", "out"}), "another recording"}};
  for (const auto& [line, says] : wrong) {
    const Outcome outcome = run_program(sample.folder(), line);
    EXPECT_EQ(outcome.exit_code, 3) << says;
    EXPECT_THAT(outcome.err, IsOneLineOfError());
    EXPECT_THAT(outcome.err, HasSubstr(says));
    EXPECT_FALSE(std::filesystem::exists(sample.folder() / "out"));
  }
}

#ifndef __SANITIZE_ADDRESS__  // which takes more memory than is given here
TEST(Program, SlamDoesWithoutThreadsThatCannotBeHad) {
  const Sample sample;
  const auto slam = [&](const std::string& limits, const std::string& more) {
    const std::string command =
        limits + TRUNDLE_PROGRAM +
        " slam seen --robot sighted.toml --filter fastslam2 --particles 20000 --quiet -o " + more;
    return run_program(sample.folder(), {"-c", command}, {.program = "/bin/sh"});
  };
  const Outcome few = slam("ulimit -s 131072; ulimit -v 1500000; ", "few --threads 256");  // [kB]
  EXPECT_EQ(few.exit_code, 0) << few.err;
  EXPECT_TRUE(std::filesystem::exists(sample.folder() / "few/landmarks.csv"));
}
#endif

TEST(Program, HelpNamesEveryCommand) {
  const Sample sample;
  const Outcome outcome = run_program(sample.folder(), {"--help"});
  EXPECT_EQ(outcome.exit_code, 0);
  for (const Command& command : kCommands) EXPECT_THAT(outcome.out, HasSubstr("\n  " + command.name + " "));
}

TEST(Program, SaysWhenHelpOrVersionMeetAFullStdout) {
  const Sample sample;
  for (const std::string line : {" --help", " --version", " run --help"}) {
    const Outcome outcome =
        run_program(sample.folder(), {"-c", TRUNDLE_PROGRAM + line + " > /dev/full"}, {.program = "/bin/sh"});
    EXPECT_EQ(outcome.exit_code, 3) << line;
    EXPECT_THAT(outcome.err, IsOneLineOfError()) << line;
  }
}

TEST(Program, SaysItsVersion) {
  const Sample sample;
  const Outcome outcome = run_program(sample.folder(), {"--version"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_THAT(outcome.out,
              testing::MatchesRegex("trundle [0-9]+\\.[0-9]+\\.[0-9]+\n|[0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

}  // namespace
}  // namespace trundle::test
