#include "trundle/simulation/scenario_file.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/io/file.hpp"

namespace trundle::simulation {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRobot = R"([[wheel]]
name = "left"
y_m = 0.15
diameter_m = 0.1
ticks_per_revolution = 1000
[[wheel]]
name = "right"
y_m = -0.15
diameter_m = 0.1
ticks_per_revolution = 1000
)";

/// A folder of its own that goes away again.
class Folder {
 public:
  Folder()
      : path_(fs::path(testing::TempDir()) / testing::UnitTest::GetInstance()->current_test_info()->name()) {
    fs::remove_all(path_);
    write_file(path_ / "robot.toml", kRobot);
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  Plan plan(const std::string& scenario, std::optional<std::uint64_t> seed = {}) const {
    write_file(path_ / "scenario.toml", scenario);
    return read_plan(path_ / "scenario.toml", seed);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

const std::string kHead = "robot = \"robot.toml\"\n";
const std::string kRun = "[[run]]\n[[run.path]]\ndrive = \"straight\"\nlength_m = 1\n";

TEST(ScenarioFile, AVelocityErrsWhereItSaysSoAndScattersBetweenSessions) {
  const Folder folder;
  write_file(folder.path() / "robot.toml", "[noise]\nwheel_per_sqrt_m = 0.01\n");
  const Plan plan = folder.plan(kHead +
                                "sessions = 200\n[truth.velocity]\nforward_scale = 1.03\n"
                                "yaw_bias_rad_s = 0.002\n[session_spread.velocity]\nyaw_scale = 0.01\n" +
                                kRun);
  ASSERT_EQ(plan.runs.size(), 200u);
  double squares = 0.0;
  for (const auto& run : plan.runs) {
    const VelocityCorrection& velocity = run.scenario.truth.chassis.velocity;
    EXPECT_EQ(velocity.forward_scale, 1.03);
    EXPECT_EQ(velocity.yaw_bias_rad_s, 0.002);
    squares += (velocity.yaw_scale - 1.0) * (velocity.yaw_scale - 1.0) / 200.0;
  }
  EXPECT_NEAR(squares / 1e-4, 1.0, 4.0 * std::sqrt(2.0 / 200.0));  // a mean square of so many numbers
}

TEST(ScenarioFile, NoRobotLagsBehindWhatItIsTold) {
  const Folder folder;
  const auto error_of = [&](const std::string& robot, const std::string& scenario) -> std::string {
    write_file(folder.path() / "robot.toml", robot);
    try {
      static_cast<void>(folder.plan(kHead + scenario + kRun));
    } catch (const InputError& error) {
      return error.what();
    }
    return "none";
  };
  EXPECT_EQ(error_of("[velocity]\nyaw_scale = 0.9\n", ""), "none");
  EXPECT_THAT(error_of("[velocity]\nlag_s = 0.1\n", ""),
              testing::HasSubstr("robot.toml: [velocity] has a lag_s"));
  for (const char* section : {"[truth.velocity]", "[session_spread.velocity]"})
    EXPECT_THAT(error_of("[noise]\n", std::string(section) + "\nlag_s = 0.1\n"),
                testing::HasSubstr("velocity has a lag_s"));
}

TEST(ScenarioFile, TruthDiffersWhereItSaysSo) {
  const Folder folder;
  const Plan plan = folder.plan(kHead + R"(
steering = "truth"
[truth]
track_m = 0.31
[truth.wheel.left]
diameter_m = 0.101
direction_deg = 1
[truth.gyro]
bias_rad_s = 0.01
[truth.noise]
wheel_per_sqrt_m = 0.002
[truth.reference_sensor]
x_m = 0.1
)" + kRun);
  const Scenario& scenario = plan.runs.front().scenario;
  EXPECT_EQ(scenario.steering, Steering::truth);
  EXPECT_NEAR(scenario.truth.chassis.wheels()[0].y_m, 0.155, 1e-15);
  EXPECT_NEAR(scenario.truth.chassis.wheels()[1].y_m, -0.155, 1e-15);
  EXPECT_EQ(scenario.truth.chassis.wheels()[0].diameter_m, 0.101);
  EXPECT_EQ(scenario.truth.chassis.wheels()[0].direction_rad, radians(1.0));
  EXPECT_EQ(scenario.truth.chassis.wheels()[1].diameter_m, 0.1);
  EXPECT_EQ(scenario.truth.chassis.gyro->bias_rad_s, 0.01);
  EXPECT_EQ(scenario.truth.chassis.noise.wheel_per_sqrt_m, 0.002);
  EXPECT_EQ(scenario.truth.body_from_reference.x, 0.1);
  EXPECT_EQ(scenario.nominal.chassis.wheels()[0].diameter_m, 0.1);
  EXPECT_FALSE(scenario.nominal.chassis.gyro);
}

TEST(ScenarioFile, TruthOfSteeredAndPassiveWheels) {
  const Folder folder;
  write_file(folder.path() / "robot.toml", R"([[wheel]]
name = "front"
x_m = 0.5
diameter_m = 0.1
ticks_per_revolution = 1000
steered = true
steering_ticks_per_revolution = 4096
[[wheel]]
name = "rear"
passive = true
)");
  const Plan plan = folder.plan(kHead + R"(
sessions = 2
[truth.wheel.front]
x_m = 0.51
steering_zero_deg = 2
[truth.wheel.rear]
x_m = 0.01
[session_spread.wheel.front]
steering_scale = 0.01
[steered_wheels]
ramp_s = 0.5
unit = "ticks"
)" + kRun);
  const Scenario& scenario = plan.runs.front().scenario;
  EXPECT_EQ(scenario.truth.chassis.all_wheels()[0].x_m, 0.51);
  EXPECT_EQ(scenario.truth.chassis.all_wheels()[0].steering->zero_rad, radians(2.0));
  EXPECT_EQ(scenario.truth.chassis.all_wheels()[1].x_m, 0.01);
  EXPECT_NE(scenario.truth.chassis.all_wheels()[0].steering->scale, 1.0);
  EXPECT_NEAR(scenario.truth.chassis.all_wheels()[0].steering->scale, 1.0, 0.06);
  EXPECT_EQ(scenario.steered.ramp_s, 0.5);
  EXPECT_EQ(scenario.steered.unit, WheelUnit::ticks);
  EXPECT_THROW((void)folder.plan(kHead + "[truth.wheel.rear]\ndiameter_m = 1\n" + kRun), InputError);
}

TEST(ScenarioFile, RunsRepeatAndOverrideSensors) {
  const Folder folder;
  const Plan plan = folder.plan(kHead + R"(
name = "lab"
[reference]
rate_hz = 10
position_sigma_m = 0.002
[[run]]
name = "ccw"
repeat = 3
[[run.path]]
drive = "square"
side_m = 2
[[run]]
name = "straight"
[run.reference]
rate_hz = 0
[run.partial_reference]
distance = true
[[run.path]]
drive = "pause"
duration_s = 1
[[run.path]]
drive = "straight"
length_m = 3
forward_m_s = 1.5
)");
  ASSERT_EQ(plan.runs.size(), 4u);
  EXPECT_EQ(plan.runs[1].name, "ccw_02");
  EXPECT_EQ(plan.runs[1].session, "lab");
  EXPECT_NE(plan.runs[0].scenario.seed, plan.runs[1].scenario.seed);
  EXPECT_EQ(plan.runs[0].scenario.reference.rate_hz, 10.0);
  const Scenario& straight = plan.runs[3].scenario;
  EXPECT_EQ(straight.reference.rate_hz, 0.0);
  EXPECT_EQ(straight.reference.position_sigma_m, 0.002);
  EXPECT_TRUE(straight.partial.distance);
  EXPECT_FALSE(plan.runs[0].scenario.partial.distance);
  EXPECT_NEAR(duration_of(straight.path), 1.0 + 2.0, 1e-12);
}

TEST(ScenarioFile, SessionsScatterTheTruth) {
  const Folder folder;
  const Plan plan =
      folder.plan(kHead + "sessions = 200\n[truth]\ntrack_m = 0.31\n[session_spread]\ntrack_m = 0.002\n" +
                  "[session_spread.wheel.right]\ndiameter_m = 0.0003\n" + kRun);
  ASSERT_EQ(plan.runs.size(), 200u);
  double track2 = 0.0, diameter2 = 0.0;
  for (const PlannedRun& run : plan.runs) {
    const auto wheels = run.scenario.truth.chassis.wheels();
    EXPECT_EQ(wheels[0].diameter_m, 0.1);
    track2 += std::pow((wheels[0].y_m - wheels[1].y_m - 0.31) / 0.002, 2) / 200.0;
    diameter2 += std::pow((wheels[1].diameter_m - 0.1) / 0.0003, 2) / 200.0;
  }
  EXPECT_NEAR(track2, 1.0, 4.0 * std::sqrt(2.0 / 200.0));
  EXPECT_NEAR(diameter2, 1.0, 4.0 * std::sqrt(2.0 / 200.0));
}

TEST(ScenarioFile, EveryStepOfAPathIsUnderstood) {
  const Folder folder;
  const Plan plan = folder.plan(kHead + R"(
[[run]]
path = [
  { drive = "pause", duration_s = 1 }, { drive = "straight", length_m = -1 }, { drive = "turn", angle_deg = 90 },
  { drive = "arc", length_m = 1, angle_deg = 45 }, { drive = "square", side_m = 1, turn = "cw" },
  { drive = "l_run", side_m = 1 }, { drive = "l_run", side_m = 1, sideways = true },
  { drive = "circle", radius_m = 1, turns = 1.5 }, { drive = "figure_eight", radius_m = 0.5 },
  { drive = "waypoints", points = [[1, 0], [1.5, 2]] }, { drive = "tour", length_m = 5, sideways = true },
]
)");
  EXPECT_GT(length_of(plan.runs.front().scenario.path), 25.0);
}

TEST(ScenarioFile, SeedOfTheCommandLineWins) {
  const Folder folder;
  EXPECT_EQ(folder.plan(kHead + "seed = 4\n" + kRun).seed, 4u);
  EXPECT_EQ(folder.plan(kHead + "seed = 4\n" + kRun, 9).seed, 9u);
}

TEST(ScenarioFile, OneRunIsTheFolderSeveralAreBelowIt) {
  const Folder folder;
  const fs::path out = folder.path() / "out";
  write_plan(folder.plan(kHead + "[reference]\nrate_hz = 5\n" + kRun), out / "one", {"head"});
  for (const char* file :
       {"wheels.csv", "reference.csv", "recording.toml", "robot.toml", "truth.toml", "truth.csv"})
    EXPECT_TRUE(fs::exists(out / "one" / file)) << file;
  EXPECT_THAT(read_file(out / "one" / "truth.csv"), testing::StartsWith("# head\n"));
  const Recording recording = read_recording(out / "one");
  EXPECT_GT(recording.wheels.time_s.size(), 50u);
  EXPECT_TRUE(recording.has_reference());

  write_plan(folder.plan(kHead + "name = \"s\"\nsessions = 2\n" + kRun), out / "two", {});
  EXPECT_TRUE(fs::exists(out / "two" / "robot.toml"));
  EXPECT_TRUE(fs::exists(out / "two" / "s_02" / "truth.toml"));
  EXPECT_EQ(read_recording(out / "two" / "s_02" / "run").session, "s_02");
}

TEST(ScenarioFile, ASimulationLeavesNothingOfTheOneBefore) {
  const Folder folder;
  const fs::path out = folder.path() / "out";
  write_plan(folder.plan(kHead + "[reference]\nrate_hz = 5\n" + kRun), out, {});
  write_file(out / "notes.txt", "mine");
  write_plan(folder.plan(kHead + kRun), out, {});
  EXPECT_TRUE(fs::exists(out / "wheels.csv"));
  EXPECT_FALSE(fs::exists(out / "reference.csv"));
  EXPECT_TRUE(fs::exists(out / "notes.txt"));
}

TEST(ScenarioFile, ASimulationRemovesNothingThatWasReallyRecorded) {
  const Folder folder;
  const fs::path out = folder.path() / "out";
  write_file(out / "reference.csv", "time_s,x_m,y_m\n0,0,0\n");
  write_plan(folder.plan(kHead + kRun), out, {});
  EXPECT_TRUE(fs::exists(out / "reference.csv"));
}

struct Mistake {
  const char* name;
  std::string text;
  int line;
  const char* says;
};

class Mistakes : public testing::TestWithParam<Mistake> {};

TEST_P(Mistakes, AreNamedWithTheirLine) {
  const fs::path folder = fs::path(testing::TempDir()) / (std::string("mistake_") + GetParam().name);
  write_file(folder / "robot.toml", kRobot);
  write_file(folder / "scenario.toml", GetParam().text);
  try {
    read_plan(folder / "scenario.toml");
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& error) {
    const std::string place =
        "scenario.toml" + (GetParam().line > 0 ? ":" + std::to_string(GetParam().line) : "");
    EXPECT_THAT(error.what(), testing::HasSubstr(place + ": "));
    EXPECT_THAT(error.what(), testing::HasSubstr(GetParam().says));
    EXPECT_THAT(error.what(), testing::HasSubstr("; expected "));
  }
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(
    Files, Mistakes,
    testing::Values(
        Mistake{"NoToml", "robot = \n", 1, ""}, Mistake{"NoRobot", kRun, 1, "robot"},
        Mistake{"UnknownKey", kHead + "steerring = \"truth\"\n" + kRun, 2, "'steering'"},
        Mistake{"UnknownSteering", kHead + "steering = \"odo\"\n" + kRun, 2, "odometry"},
        Mistake{"NameThatLeadsOutside", kHead + "name = \"../../outside\"\nsessions = 2\n" + kRun, 2,
                "../../outside"},
        Mistake{"NothingToDo", kHead, 0, "no [[run]]"},
        Mistake{"RunWithoutPath", kHead + "[[run]]\n", 2, "nothing to drive"},
        Mistake{"UnknownStep", kHead + "[[run]]\n[[run.path]]\ndrive = \"squre\"\n", 4, "\"square\""},
        Mistake{"StepWithoutKind", kHead + "[[run]]\n[[run.path]]\nside_m = 1\n", 3, "drive"},
        Mistake{"StepWithoutLength", kHead + "[[run]]\n[[run.path]]\ndrive = \"straight\"\n", 3, "length_m"},
        Mistake{"StepWithWrongKey",
                kHead + "[[run]]\n[[run.path]]\ndrive = \"straight\"\nlength_m = 1\nside_m = 1\n", 6,
                "side_m"},
        Mistake{"UnknownTurn",
                kHead + "[[run]]\n[[run.path]]\ndrive = \"square\"\nside_m = 1\nturn = \"left\"\n", 6, "ccw"},
        Mistake{"NegativeSide", kHead + "[[run]]\n[[run.path]]\ndrive = \"square\"\nside_m = -1\n", 5,
                "side_m"},
        Mistake{"PointsOfThree",
                kHead + "[[run]]\n[[run.path]]\ndrive = \"waypoints\"\npoints = [[1, 2, 3]]\n", 5, "pair"},
        Mistake{"UnknownWheel", kHead + "[truth.wheel.lefft]\ndiameter_m = 1\n" + kRun, 2, "'left'"},
        Mistake{"UnknownTruth", kHead + "[truth]\ntrak_m = 1\n" + kRun, 3, "'track_m'"},
        Mistake{"VelocityOfWheels", kHead + "[truth.velocity]\nforward_scale = 1.1\n" + kRun, 2,
                "no [[wheel]]"},
        Mistake{"UnknownSpread", kHead + "[session_spread.gyro]\nscal = 1\n" + kRun, 3, "'scale'"},
        Mistake{"TextForNumber", kHead + "[encoders]\nrate_hz = \"fast\"\n" + kRun, 3, "rate_hz"},
        Mistake{"NoRate", kHead + "[encoders]\nrate_hz = 0\n" + kRun, 3, "above 0"},
        Mistake{"UnknownUnit", kHead + "[encoders]\nunit = \"inches\"\n" + kRun, 3, "ticks"},
        Mistake{"TicksOfNoSteering", kHead + "[truth.wheel.left]\nsteering_zero_deg = 1\n" + kRun, 3,
                "expected"},
        Mistake{"FlagThatIsNone", kHead + "[reference]\nwith_heading = 1\n" + kRun, 3, "true or false"},
        Mistake{"GapWithoutEnd", kHead + "[[reference.gap]]\nstart_s = 1\n" + kRun, 2, "duration_s"},
        Mistake{"SlipOfNoWheel",
                kHead + kRun + "[[run.slip]]\nwheel = \"rear\"\nstart_s = 1\nduration_s = 1\n", 7,
                "left, right"},
        Mistake{"LockedSteeringWheel",
                kHead + kRun + "[[run.slip]]\nwheel = \"left\"\nstart_s = 1\nduration_s = 1\nfactor = 0\n",
                10, "above 0"},
        Mistake{"RepeatOfNone",
                kHead + "[[run]]\nrepeat = 0\n[[run.path]]\ndrive = \"straight\"\nlength_m = 1\n", 3,
                "repeat"},
        Mistake{"NameThatIsNoFolder",
                kHead + "[[run]]\nname = \"../a\"\n[[run.path]]\ndrive = \"straight\"\nlength_m = 1\n", 3,
                "folder"},
        // They would be held in memory, simulated for ever, or written elsewhere.
        Mistake{"PlanThatIsNoFolder", kHead + "name = \"../a\"\n" + kRun, 2, "folder"},
        Mistake{"RunWithoutEnd", kHead + "[pace]\nforward_m_s = 1e-300\n" + kRun, 4, "samples"},
        Mistake{"RowsOfYears", kHead + "[encoders]\nrate_hz = 1e-8\n" + kRun, 4, "samples"},
        Mistake{"TourInAPoint",
                kHead + "[[run]]\n[[run.path]]\ndrive = \"tour\"\nlength_m = 1\nbox_x_m = 1e-300\n", 6,
                "box_x_m"},
        Mistake{
            "RunsWithoutEnd",
            kHead +
                "sessions = 9999\n[[run]]\nrepeat = 9999\n[[run.path]]\ndrive = \"straight\"\nlength_m = 1\n",
            3, "9999 runs"},
        Mistake{"TwoOfAName", kHead + kRun + kRun, 2, "run"},
        Mistake{"RunThatIsNoArray", kHead + "[run]\nname = \"a\"\n", 2, "[[run]]"},
        Mistake{"LandmarkWithoutPlace", kHead + "[[landmark]]\nname = \"a\"\ny_m = 1\n" + kRun, 2, "x_m"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace trundle::simulation
