// No command writes its results over what it was made from.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/file.hpp"

#include "app/one_line_of_error.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;

/// A command line in the folder of a Sample with `other`, a copy of the recording `seen`, of which one output
/// is an input.
struct Case {
  std::string name;
  Arguments arguments;
};

const std::vector<Case> kCases = {
    {"CheckpointOverWheels",
     {"slam", "seen", "--robot", "sighted.toml", "--checkpoint", "seen/wheels.csv", "-o", "o"}},
    {"CheckpointOverRobot",
     {"slam", "seen", "--robot", "sighted.toml", "--checkpoint", "./sighted.toml", "-o", "o"}},
    {"CheckpointOverWhatWasLearnedFrom",
     {"slam", "seen", "--robot", "seeing.toml", "--correct-slip", "--learn", "other", "--checkpoint",
      "other/wheels.csv", "-o", "o"}},
    {"MapOverRobot", {"slam", "seen", "--robot", "landmarks.csv", "-o", "."}},
    {"ResultOverCheckpoint",
     {"slam", "seen", "--robot", "sighted.toml", "--checkpoint", "o/steps.csv", "-o", "o"}},
    {"LocalizeOverMap", {"localize", "seen", "--robot", "sighted.toml", "--map", "map.csv", "-o", "map.csv"}},
    {"LocalizeOverLinkToRobot",
     {"localize", "seen", "--robot", "sighted.toml", "--map", "map.csv", "-o", "link.toml"}},
    {"OdometryOverRobot", {"odometry", "cw", "--robot", "nominal.toml", "-o", "nominal.toml"}},
    {"SlipOverRobot", {"slip", "gyrating", "--robot", "with_gyro.toml", "-o", "with_gyro.toml"}},
    {"CorrectedOverRobot",
     {"slip", "gyrating", "--robot", "with_gyro.toml", "-o", "s.csv", "--corrected", "with_gyro.toml"}},
    {"CalibrateOverNominal", {"calibrate", "cw", "ccw", "--robot", "nominal.toml", "-o", "nominal.toml"}},
    {"CalibrationOverRobot", {"calibrate", "cw", "ccw", "--robot", "calibration.json", "-o", "new.toml"}},
    {"UmbmarkOverSheet", {"umbmark", "sheet.csv", "--robot", "nominal.toml", "-o", "sheet.csv"}},
    {"RunOverRobot", {"run", "ccw", "--robot", "calibrated.toml", "-o", "."}},
    {"SimulateOverScenario", {"simulate", "recording.toml", "-o", "."}},
    {"ReportOverResult", {"report", "ccw/reference.csv", "-o", "ccw/reference.csv"}},
    {"LiveOverRobot", {"live", "--robot", "nominal.toml", "--checkpoint", "nominal.toml"}},
};

void PrintTo(const Case& which, std::ostream* stream) {
  *stream << which.name;
}

class InputsAreKept : public testing::TestWithParam<Case> {};

TEST_P(InputsAreKept, AndTheOneInDangerIsNamed) {
  const Sample sample;
  const std::filesystem::path& folder = sample.folder();
  const auto copy = [&](const char* from, const char* to) {
    std::filesystem::copy(folder / from, folder / to, std::filesystem::copy_options::recursive);
  };
  copy("seen", "other");
  for (const char* name : {"landmarks.csv", "calibration.json", "calibrated.toml"})
    copy("sighted.toml", name);
  copy("scenario.toml", "recording.toml");
  std::filesystem::create_symlink("sighted.toml", folder / "link.toml");
  write_file(folder / "seeing.toml", read_file(folder / "with_gyro.toml") + "[landmark_sensor]\n");
  std::string gyro = "time_s,yaw_rate_rad_s\n";
  for (int k = 0; k <= 280; ++k) gyro += std::to_string(0.05 * k) + (k / 40 % 2 == 0 ? ",0\n" : ",1.05\n");
  copy("ccw", "gyrating");
  for (const char* name : {"gyrating/gyro.csv", "seen/gyro.csv", "other/gyro.csv"})
    write_file(folder / name, gyro);

  const auto before = files_below(folder);
  Circumstances no_input{.input = "sheet.csv"};
  const Outcome outcome = run_program(folder, GetParam().arguments, no_input);
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_THAT(outcome.err, HasSubstr("which would be lost"));
  for (const auto& [path, content] : before) EXPECT_EQ(read_file(folder / path), content) << path;
}

INSTANTIATE_TEST_SUITE_P(, InputsAreKept, testing::ValuesIn(kCases),
                         [](const auto& test) { return test.param.name; });

TEST(ACheckpoint, IsTakenUpAndWrittenInOnePlace) {
  const Sample sample;
  const auto slam = [&](const std::string& recording, const Arguments& more) {
    Arguments line = {"slam", recording, "--robot", "sighted.toml", "--checkpoint", "state", "-o", "o"};
    line.insert(line.end(), more.begin(), more.end());
    return run_program(sample.folder(), line).exit_code;
  };
  EXPECT_EQ(slam("seen_half", {}), 0);
  EXPECT_EQ(slam("seen", {"--resume", "state"}), 0);
}

TEST(AReport, DoesNotGoOverTheRecordOfItsRun) {
  const Sample sample;
  ASSERT_EQ(run_program(sample.folder(), {"run", "ccw", "--robot", "nominal.toml", "-o", "o"}).exit_code, 0);
  const std::string record = read_file(sample.folder() / "o/run.json");
  const Outcome outcome = run_program(sample.folder(), {"report", "o", "-o", "o/run.json"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("which would be lost"));
  EXPECT_EQ(read_file(sample.folder() / "o/run.json"), record);
}

TEST(AReport, DoesNotGoOverTheRecordingThatItIsComparedWith) {
  const Sample sample;
  ASSERT_EQ(run_program(sample.folder(), {"run", "ccw", "--robot", "nominal.toml", "-o", "o"}).exit_code, 0);
  const std::string wheels = read_file(sample.folder() / "ccw/wheels.csv");
  const Outcome outcome =
      run_program(sample.folder(), {"report", "o", "--reference", "ccw", "-o", "ccw/wheels.csv"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, HasSubstr("which would be lost"));
  EXPECT_EQ(read_file(sample.folder() / "ccw/wheels.csv"), wheels);
}

TEST(AFile, HoldsOneResult) {
  const Sample sample;
  for (const char* spelling : {"o/../t.csv", "./t.csv", "seen/../t.csv"}) {
    const Outcome outcome =
        run_program(sample.folder(), {"localize", "seen", "--robot", "sighted.toml", "--map", "map.csv",
                                      "--steps", spelling, "-o", "t.csv"});
    EXPECT_EQ(outcome.exit_code, 3);
    EXPECT_THAT(outcome.err, IsOneLineOfError());
    EXPECT_THAT(outcome.err, HasSubstr("two results"));
    EXPECT_FALSE(std::filesystem::exists(sample.folder() / "t.csv"));
  }
}

TEST(ADevice, IsNoPlaceForResults) {
  const Sample sample;
  const Outcome outcome =
      run_program(sample.folder(), {"odometry", "cw", "--robot", "nominal.toml", "-o", "/dev/full"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_THAT(outcome.err, IsOneLineOfError());
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

}  // namespace
}  // namespace trundle::test
