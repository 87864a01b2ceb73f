#include "trundle/calibration/squares/square_runs.hpp"

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "trundle/io/error.hpp"
#include "trundle/simulation/sensors.hpp"

#include "real_data.hpp"

namespace trundle::calibration {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr double kSide = 2.0;

Robot robot_with(const SidedDrive& drive) {
  Robot robot;
  robot.name = "cart";
  robot.chassis = differential_drive({.diameter_m = 0.15, .ticks_per_revolution = 20000}, 0.5);
  robot.wheel_names = {"left", "right"};
  return with_drive(robot, drive);
}
const SidedDrive kNominal = {0.15, 0.15, 0.5};
const SidedDrive kTruth = {0.1500, 0.1515, 0.53};

Scenario scenario(TurnSense turn) {
  Scenario scenario;
  scenario.nominal = robot_with(kNominal);
  scenario.truth = robot_with(kTruth);
  scenario.truth.chassis.noise = {0.0, 0.0, 0.0, 0.0, 0.0};
  scenario.path = square(kSide, turn);
  scenario.start = {3.0, -1.0, 2.5};
  scenario.encoders.quantised = false;
  scenario.reference.rate_hz = 20.0;
  return scenario;
}

Recording simulated(TurnSense turn) {
  Recording recording = simulate(scenario(turn)).recording;
  recording.name = turn == TurnSense::cw ? "cw" : "ccw";
  return recording;
}

TEST(SquareRuns, EndErrorsAreThoseOfTheExactSquare) {
  const std::vector<Recording> recordings = {simulated(TurnSense::cw), simulated(TurnSense::ccw)};
  const SquareSheet sheet = end_errors_of_square_runs(recordings, robot_with(kNominal), kSide);
  ASSERT_EQ(sheet.runs.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const SquareRun& run = sheet.runs[i];
    EXPECT_EQ(run.turn, i == 0 ? Turn::cw : Turn::ccw);
    EXPECT_EQ(run.name, i == 0 ? "cw" : "ccw");
    const Pose2 expected = predict_square(kTruth, kNominal, kSide, run.turn);
    EXPECT_NEAR(run.error.x, expected.x, 1e-6);
    EXPECT_NEAR(run.error.y, expected.y, 1e-6);
    EXPECT_NEAR(run.error.heading, expected.heading, 1e-6);
    ASSERT_TRUE(run.leg_m.has_value());
    // The ends of a leg are seen a little into the turns, which moves the centre: cw and ccw err opposite
    // ways.
    EXPECT_NEAR(*run.leg_m, predict_leg(kTruth, kNominal, kSide), 5e-4);
  }
  EXPECT_NEAR(*means_of(sheet).leg_m, predict_leg(kTruth, kNominal, kSide), 1e-5);
}

TEST(SquareRuns, OrientationRecoversTheRobotAndReprocessesTheCounts) {
  const std::vector<Recording> recordings = {simulated(TurnSense::cw), simulated(TurnSense::ccw)};
  const CalibrationResult result = umbmark(recordings, robot_with(kNominal), kSide);
  const SidedDrive found = sided_drive(result.calibrated);
  EXPECT_NEAR(found.left_diameter_m / kTruth.left_diameter_m, 1.0, 1e-4);
  EXPECT_NEAR(found.right_diameter_m / kTruth.right_diameter_m, 1.0, 1e-4);
  EXPECT_NEAR(found.track_m / kTruth.track_m, 1.0, 1e-4);
  EXPECT_EQ(result.after_meaning, "reprocessed");
  EXPECT_NEAR(*result.e_max_before_m, 0.7149, 5e-5);
  EXPECT_LT(*result.e_max_after_m, 1e-3);
  EXPECT_LT(result.runs[0].after->position_max_m, 1e-3);
  EXPECT_GT(result.runs[0].reference.poses.size(), 100U);
}

TEST(SquareRuns, AReferenceSensorBesideTheCentreSeesTheSameErrors) {
  Scenario beside = scenario(TurnSense::cw);
  beside.truth.body_from_reference = {0.2, -0.1, 0.7};
  const std::vector<Recording> recordings = {simulate(beside).recording};
  Robot nominal = robot_with(kNominal);
  nominal.body_from_reference = beside.truth.body_from_reference;
  const SquareSheet sheet = end_errors_of_square_runs(recordings, nominal, kSide);
  const Pose2 expected = predict_square(kTruth, kNominal, kSide, Turn::cw);
  EXPECT_NEAR(sheet.runs[0].error.x, expected.x, 1e-6);
  EXPECT_NEAR(sheet.runs[0].error.heading, expected.heading, 1e-6);
}

TEST(SquareRuns, AnEndPoseAloneIsEnoughButShowsNoLeg) {
  Scenario measured = scenario(TurnSense::ccw);
  measured.reference.rate_hz = 0.0;
  measured.partial = {.end_pose = true, .position_sigma_m = 0.0, .heading_sigma_rad = 0.0};
  const std::vector<Recording> recordings = {simulate(measured).recording};
  const SquareRun run = end_errors_of_square_runs(recordings, robot_with(kNominal), kSide).runs[0];
  const Pose2 expected = predict_square(kTruth, kNominal, kSide, Turn::ccw);
  EXPECT_EQ(run.turn, Turn::ccw);
  EXPECT_NEAR(run.error.y, expected.y, 1e-6);
  EXPECT_NEAR(run.error.heading, expected.heading, 1e-6);
  EXPECT_FALSE(run.leg_m.has_value());
}

void expect_refusal(const Recording& recording, const std::string& why) {
  try {
    end_errors_of_square_runs(std::vector<Recording>{recording}, robot_with(kNominal), kSide);
    FAIL() << "was accepted: " << why;
  } catch (const CannotAnswer& answer) {
    EXPECT_THAT(answer.what(), HasSubstr(why));
  }
}

TEST(SquareRuns, OtherRunsAreRefused) {
  Scenario ahead = scenario(TurnSense::cw);
  ahead.path = straight(3.0);
  expect_refusal(simulate(ahead).recording, "no run around a square");
  Recording blind = simulated(TurnSense::cw);
  blind.reference = {};
  expect_refusal(blind, "no reference");
  Recording elsewhen = simulated(TurnSense::cw);
  for (double& time : elsewhen.reference.time_s) time += 1e6;
  expect_refusal(elsewhen, "no time in common");
  EXPECT_THROW(end_errors_of_square_runs(std::vector<Recording>{blind}, robot_with(kNominal), 0.0),
               InputError);
}

// Real recordings: what their authors published, from the very same counts.

/// A folder that is removed again.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(fs::temp_directory_path() / fmt::format("trundle_square_runs_{}", ::getpid())) {}
  ~TemporaryFolder() { fs::remove_all(path_); }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::vector<Recording> optiodom_squares(const std::string& session, const fs::path& folder) {
  std::vector<Recording> recordings;
  for (int run = 1; run <= 6; ++run) {
    const fs::path csv =
        test::real_data() / "optiodom_diff/square" / session / fmt::format("{}_run-{:02d}.csv", session, run);
    const fs::path recording = folder / session / fmt::format("run-{}", run);
    write_file(recording / "recording.toml",
               fmt::format("[wheels]\nfile = '{0}'\nheader = false\nincrements = true\n"
                           "columns = {{ time_s = 1, right_ticks = 5, left_ticks = 6 }}\n"
                           "[reference]\nfile = '{0}'\nheader = false\n"
                           "columns = {{ time_s = 1, x_m = 2, y_m = 3, heading_rad = 4 }}\n",
                           fs::absolute(csv).string()));
    recordings.push_back(read_recording(recording));
  }
  return recordings;
}

Robot optiodom_robot() {
  Robot robot;
  robot.name = "optiodom";
  robot.chassis = differential_drive({.diameter_m = 0.084, .ticks_per_revolution = 43.7 * 64}, 0.2);
  robot.wheel_names = {"left", "right"};
  return robot;
}

struct Published {
  const char* session;
  double side_m;
  double track_m, right_m, left_m;
  double e_max_before_m, e_max_after_m;  ///< of the centres of gravity, 'reprocessed', as printed in [mm]
};

class PublishedSquares : public testing::TestWithParam<Published> {};

TEST_P(PublishedSquares, ClassicGivesTheAuthorsNumbers) {
  TRUNDLE_NEEDS_REAL_DATA("optiodom_diff");
  const Published& published = GetParam();
  const TemporaryFolder folder;
  const CalibrationResult result = umbmark(optiodom_squares(published.session, folder.path()),
                                           optiodom_robot(), published.side_m, SquareMethod::classic);
  const SidedDrive found = sided_drive(result.calibrated);
  EXPECT_NEAR(found.track_m, published.track_m, 5e-7);
  EXPECT_NEAR(found.right_diameter_m, published.right_m, 5e-7);
  EXPECT_NEAR(found.left_diameter_m, published.left_m, 5e-7);
  EXPECT_NEAR(*result.e_max_before_m, published.e_max_before_m, 5e-5);
  EXPECT_NEAR(*result.e_max_after_m, published.e_max_after_m, 5e-5);
}

INSTANTIATE_TEST_SUITE_P(
    Optiodom, PublishedSquares,
    testing::Values(Published{"230620202042", 0.75, 0.201458, 0.083954, 0.084046, 0.0305, 0.0048},
                    Published{"231220200040", 1.7, 0.201698, 0.083977, 0.084023, 0.1029, 0.0212}),
    [](const auto& published) { return std::string(published.param.session); });

}  // namespace
}  // namespace trundle::calibration
