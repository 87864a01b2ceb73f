// Numbers that mean nothing do not get in, and none gets out.
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/file.hpp"
#include "trundle/recording/trajectory_file.hpp"
#include "trundle/slam/slam.hpp"

#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Arguments joined(Arguments line, const Arguments& more) {
  line.insert(line.end(), more.begin(), more.end());
  return line;
}

const Arguments kSlam = {"slam", "seen", "--robot", "sighted.toml", "-o", "out"};
const Arguments kLocalize = {"localize", "seen",    "--robot", "sighted.toml",
                             "--map",    "map.csv", "-o",      "out/t.csv"};
const Arguments kByHand = {"install-angle", "--side-m", "2", "--end-x-m", "2", "--end-y-m", "2"};

struct Wrong {
  std::string name;
  Arguments arguments;
  std::string says;
};

const std::vector<Wrong> kWrong = {
    {"SystematicSigmaNan", joined(kSlam, {"--systematic-sigma", "nan"}), "a number from 0 to 10"},
    {"SystematicSigmaInf", joined(kSlam, {"--systematic-sigma", "inf"}), "a number from 0 to 10"},
    {"CheckpointEveryNan", joined(kSlam, {"--checkpoint", "s", "--checkpoint-every-s", "nan"}), "nan"},
    {"NoSwarmIterations", joined(kSlam, {"--swarm-iterations", "0"}), "--swarm-iterations"},
    {"SwarmAgreementNan", joined(kSlam, {"--swarm-agreement", "nan"}), "a number from 0 to 1"},
    {"WindowNan", joined(kSlam, {"--filter", "smoother", "--window", "nan"}), "nan"},
    {"WindowOfAnotherFilter", joined(kSlam, {"--filter", "ekf", "--window", "60"}), "--filter smoother"},
    {"StartFarAway", joined(kSlam, {"--start", "1e300,0,0"}), "1e300"},
    {"StartFarTurned", joined(kSlam, {"--start", "0,0,-1e300"}), "1e300"},
    {"SeedBelowZero", joined(kSlam, {"--seed", "-1"}), "whole number"},
    {"SeedBeyond64Bits", joined(kSlam, {"--seed", "18446744073709551616"}), "whole number"},
    {"SeedOfSimulate", {"simulate", "scenario.toml", "-o", "out", "--seed", "-1"}, "whole number"},
    {"NoCheckpoint", joined(kSlam, {"--checkpoint", ""}), "--checkpoint"},
    {"NothingToResume", joined(kSlam, {"--resume", ""}), "--resume"},
    {"NoRobot", {"odometry", "cw", "--robot", "", "-o", "out/t.csv"}, "--robot"},
    {"NoOutput", {"odometry", "cw", "--robot", "nominal.toml", "-o", ""}, "--output"},
    {"RobotMinusOne", joined(kSlam, {"--robot-number", "-1"}), "--robot-number"},
    {"StartSigmaNan", joined(kLocalize, {"--start", "0,0,0", "--start-sigma-m", "nan"}), "a number from 0"},
    {"StartSigmaOfTurnInf", joined(kLocalize, {"--start", "0,0,0", "--start-sigma-deg", "inf"}),
     "a number from 0 to 360"},
    {"LocalizeFarAway", joined(kLocalize, {"--start", "1e300,0,0"}), "1e300"},
    {"StartSigmaWithoutStart", joined(kLocalize, {"--start-sigma-m", "1"}), "--start"},
    {"StartSigmaOfTurnWithoutStart", joined(kLocalize, {"--start-sigma-deg", "1"}), "--start"},
    {"GapNan", {"evaluate", "cw/reference.csv", "cw/reference.csv", "--longest-gap-s", "nan"}, "nan"},
    {"ProbabilityNan",
     {"slip", "cw", "--robot", "with_gyro.toml", "--probability", "nan"},
     "a number from 1e-12 to 0.5"},
    {"IntervalNan", {"slip", "cw", "--robot", "with_gyro.toml", "--interval-s", "nan"}, "nan"},
    {"LiveStepNan", {"live", "--robot", "nominal.toml", "--longest-step-s", "nan"}, "nan"},
    {"SideOfASheetNan", {"umbmark", "sheet.csv", "--robot", "nominal.toml", "--side-m", "nan"}, "nan"},
    {"SideOfAnLNan", joined(kByHand, {"--sigma-m", "nan"}), "nan"},
    {"RepeatNan", joined(kByHand, {"--repeat", "nan,2"}), "nan,2"},
};

void PrintTo(const Wrong& wrong, std::ostream* stream) {
  *stream << wrong.name;
}

class WrongNumber : public testing::TestWithParam<Wrong> {};

TEST_P(WrongNumber, IsAUsageErrorOfOneShortLine) {
  const Sample sample;
  const Outcome outcome =
      run_program(sample.folder(), GetParam().arguments, Circumstances{.input = "sheet.csv"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.out, IsEmpty());
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, HasSubstr(GetParam().says));
  EXPECT_LT(outcome.err.size(), 150U);
  EXPECT_FALSE(std::filesystem::exists(sample.folder() / "out"));
}

INSTANTIATE_TEST_SUITE_P(, WrongNumber, testing::ValuesIn(kWrong),
                         [](const auto& test) { return test.param.name; });

void expect_bad_input(const Outcome& outcome, const std::string& says) {
  EXPECT_EQ(outcome.exit_code, 3) << says;
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, HasSubstr(says));
}

TEST(TheSwarm, IsAsItWasAskedFor) {
  const Sample sample;
  const auto trajectory = [&](const Arguments& more) {
    const Arguments mapso = joined(kSlam, {"--filter", "mapso"});
    EXPECT_EQ(run_program(sample.folder(), joined(mapso, more)).exit_code, 0);
    return read_file(sample.folder() / "out/trajectory.csv");
  };
  const std::string once = trajectory({"--swarm-iterations", "1"});
  EXPECT_THAT(once, HasSubstr("swarm-iterations"));
  EXPECT_NE(once.substr(once.find("time_s")), trajectory({}).substr(trajectory({}).find("time_s")));
  const std::string adaptive = trajectory({"--swarm-agreement", "1e-12"});  // as good as reached at once
  EXPECT_EQ(once.substr(once.find("time_s")), adaptive.substr(adaptive.find("time_s")));
}

TEST(AReading, BeyondAllMeasureIsNamedByItsLine) {
  const Sample sample;
  write_file(sample.folder() / "velocity_only.toml", "[landmark_sensor]\n");
  write_file(sample.folder() / "fast/velocity.csv",
             "time_s,forward_m_s,yaw_rate_rad_s\n0,0,0\n0.1,1e300,0\n0.2,0,0\n");
  write_file(sample.folder() / "far.csv", "landmark,x_m,y_m\na,1,0\nb,1e300,0\n");
  expect_bad_input(
      run_program(sample.folder(), {"odometry", "fast", "--robot", "velocity_only.toml", "-o", "out/t.csv"}),
      "velocity.csv:3: forward_m_s is 1e+300");
  expect_bad_input(run_program(sample.folder(), {"localize", "seen", "--robot", "sighted.toml", "--map",
                                                 "far.csv", "-o", "out/t.csv"}),
                   "far.csv:3");
}

TEST(ARobotFile, WithNoiseBeyondAllMeasureIsRefused) {
  const Sample sample;
  for (const std::string noise : {"1e3", "1e6", "1e300"}) {
    write_file(sample.folder() / "wild.toml",
               read_file(sample.folder() / "sighted.toml") + "[noise]\nwheel_per_sqrt_m = " + noise + "\n");
    expect_bad_input(run_program(sample.folder(), {"slam", "seen", "--robot", "wild.toml", "-o", "out"}),
                     "expected a number of at least 0 and at most 10");
  }
}

TEST(ARobotNumber, NeedsAFolderOfRobots) {
  const Sample sample;
  expect_bad_input(run_program(sample.folder(), joined(kSlam, {"--robot-number", "3"})), "several robots");
}

void expect_sound(const std::filesystem::path& file, const std::string& what) {
  const std::string text = read_file(file);
  EXPECT_THAT(text.substr(text.find("\ntime_s")), Not(testing::ContainsRegex("nan|inf"))) << what;
  for (const Matrix3& covariance : read_trajectory(file).covariances)
    EXPECT_GE(covariance.diagonal().minCoeff(), 0.0) << what;
}

/// As noisy as a robot file may say: nothing can be told then, and what is told is sound.
TEST(Noise, WhateverItIsGivesNumbers) {
  const Sample sample;
  for (const std::string noise : {"1", "10"}) {
    write_file(sample.folder() / "noisy.toml",
               read_file(sample.folder() / "sighted.toml") +
                   fmt::format("[noise]\nwheel_per_sqrt_m = {0}\nlateral_per_sqrt_m = {0}\n", noise));
    for (const Arguments& names : {Arguments{}, Arguments{"--unknown-ids"}}) {
      for (const std::string& filter : slam_method_names()) {
        const Outcome outcome = run_program(
            sample.folder(),
            joined({"slam", "seen", "--robot", "noisy.toml", "--filter", filter, "-o", "o"}, names));
        ASSERT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 4) << filter << outcome.err;
        if (outcome.exit_code == 0) expect_sound(sample.folder() / "o/trajectory.csv", filter);
      }
      for (const std::string filter : {"ekf", "particles"}) {
        const Outcome outcome =
            run_program(sample.folder(),
                        joined({"localize", "seen", "--robot", "noisy.toml", "--map", "map.csv", "--start",
                                "0,0,0", "--start-sigma-m", "1e6", "--filter", filter, "-o", "t.csv"},
                               names));
        ASSERT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 4) << filter << outcome.err;
        if (outcome.exit_code == 0) expect_sound(sample.folder() / "t.csv", filter);
      }
    }
  }
}

TEST(Names, OfAnyKindAreReadAsTheyWereWritten) {
  const Sample sample;
  std::string sightings = read_file(sample.folder() / "seen/sightings.csv");
  for (std::size_t at; (at = sightings.find(",a,")) != std::string::npos;)
    sightings.replace(at, 3, ",\"#a \"\"x\"\"\",");
  write_file(sample.folder() / "seen/sightings.csv", sightings);
  ASSERT_EQ(run_program(sample.folder(), kSlam).exit_code, 0);
  EXPECT_THAT(read_file(sample.folder() / "out/landmarks.csv"), HasSubstr("\n\"#a \"\"x\"\"\","));
  const Outcome outcome = run_program(
      sample.folder(),
      {"localize", "seen", "--robot", "sighted.toml", "--map", "out/landmarks.csv", "--json", "-o", "t.csv"});
  EXPECT_THAT(outcome.out, HasSubstr("\"landmarks\": 3"));
  EXPECT_THAT(outcome.out, HasSubstr("\"not_in_the_map\": 0"));
}

TEST(Names, MayBeMissingInSomeRows) {
  const Sample sample;
  std::string sightings = read_file(sample.folder() / "seen/sightings.csv");
  for (std::size_t at; (at = sightings.find("\"b, left\"")) != std::string::npos;)
    sightings.replace(at, 9, "1");
  for (std::size_t at; (at = sightings.find(",c,")) != std::string::npos;) sightings.replace(at, 3, ",,");
  write_file(sample.folder() / "seen/sightings.csv", sightings);
  for (const std::string& filter : slam_method_names()) {
    const Outcome outcome = run_program(sample.folder(), joined(kSlam, {"--filter", filter, "--smooth"}));
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_THAT(outcome.out, HasSubstr("name no landmark"));
    const std::string map = read_file(sample.folder() / "out/landmarks.csv");
    for (const char* row : {"\na,", "\n1,"}) EXPECT_THAT(map, HasSubstr(row)) << filter;
    EXPECT_THAT(read_file(sample.folder() / "out/innovations.csv"), HasSubstr(",2,created")) << filter;
  }
  const Outcome localized =
      run_program(sample.folder(), {"localize", "seen", "--robot", "sighted.toml", "--map",
                                    "out/landmarks.csv", "--start", "0,0,0", "-o", "t.csv"});
  EXPECT_EQ(localized.exit_code, 0) << localized.err;
}

TEST(Smoothing, OfNothingSurelyThereLeavesTheFiltersResult) {
  const Sample sample;
  const Outcome outcome = run_program(sample.folder(), {"slam", "unnamed", "--robot", "sighted.toml",
                                                        "--unknown-ids", "--smooth", "-o", "out"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("warning: unnamed: no landmark is surely there"));
  EXPECT_TRUE(std::filesystem::exists(sample.folder() / "out/trajectory.csv"));
}

}  // namespace
}  // namespace trundle::test
