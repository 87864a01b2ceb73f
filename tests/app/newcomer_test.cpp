// What somebody gets wrong who writes recording.toml and robot.toml for the first time: one line says what it
// is and what to write, and the exit code is that of bad input; or all is well.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/file.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// The files that a newcomer makes, right.
struct Files {
  std::string log;  ///< t, x, y, heading, counts of left and right since the row before
  std::string imu;  ///< stamp [ms], yaw rate [deg/s]
  std::string recording = R"([wheels]
file = "log.csv"
header = false
increments = true
columns.time_s = 1
columns.left_ticks = 5
columns.right_ticks = 6
[reference]
file = "log.csv"
header = false
columns.time_s = 1
columns.x_m = 2
columns.y_m = 3
columns.heading_rad = 4
[gyro]
file = "imu.csv"
time_unit = "ms"
columns.time_s = "stamp"
columns.yaw_rate_rad_s = { column = "rate", unit = "deg/s" }
)";
  std::string robot = R"(name = "mine"
[[wheel]]
name = "left"
y_m = 0.1
diameter_m = 0.1
ticks_per_revolution = 1000
[[wheel]]
name = "right"
y_m = -0.1
diameter_m = 0.1
ticks_per_revolution = 1000
[gyro]
)";
};

/// A minute at 20 Hz: it drives and stops, and winds both ways.
Files drive() {
  Files files;
  files.imu = "stamp,rate\n";
  const double counts_per_m = 1000.0 / (0.1 * 3.141592653589793);
  double x = 0.0, y = 0.0, heading = 0.0, left = 0.0, right = 0.0;
  std::mt19937 random(5);
  std::normal_distribution<double> tremble(0.0, 0.002);
  for (int row = 0; row < 1200; ++row) {
    const double t = 0.05 * row, in_leg = std::fmod(t, 15.0);
    const double speed =
        in_leg < 3.0 || in_leg > 13.0 ? 0.0 : 0.4 * std::min({1.0, in_leg - 3.0, 13.0 - in_leg});
    const double rate = speed > 0.0 ? 2.0 * std::sin(0.5 * t) + 0.3 : 0.0;
    const double way = speed > 0.0 ? 0.05 * speed + tremble(random) : 0.0;
    const auto counts = [&](double& sum, double side) {
      const double before = std::round(sum);
      sum += counts_per_m * (way + side * 0.1 * 0.05 * rate);
      return std::round(sum) - before;
    };
    heading += 0.025 * rate;
    x += way * std::cos(heading);
    y += way * std::sin(heading);
    heading += 0.025 * rate;
    const double l = counts(left, -1.0), r = counts(right, 1.0);
    files.log += fmt::format("{:.2f},{:.5f},{:.5f},{:.5f},{:.0f},{:.0f}\n", t, x, y, heading, l, r);
    files.imu += fmt::format("{:.0f},{:.4f}\n", 1e3 * t, rate * 57.29577951308232);
  }
  return files;
}

struct Mistake {
  const char* name;
  std::function<void(Files&)> make;
  int exit_code;
  const char* words;  ///< of stderr where it is refused, of the problems otherwise; empty: no problem
  bool alone = true;  ///< false: it has consequences that are told after it
};

void replace(std::string& text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

/// The line with that number, counted from 0, with its end.
std::string line(const std::string& text, int number) {
  std::size_t at = 0;
  for (; number > 0; --number) at = text.find('\n', at) + 1;
  return text.substr(at, text.find('\n', at) + 1 - at);
}

const Mistake kMistakes[] = {
    {"none", [](Files&) {}, 0, ""},
    {"forgotten_increments", [](Files& f) { replace(f.recording, "increments = true\n", ""); }, 0,
     "write increments = true under [wheels]"},
    {"increments_of_totals",
     [](Files& f) {
       std::string log;
       for (int row = 0; row < 1200; ++row)
         log += fmt::format("{:.2f},0,0,0,{},{}\n", 0.05 * row, 20 * row, 21 * row);
       f.log = log;
     },
     0, "leave out increments = true"},
    {"forgotten_header", [](Files& f) { replace(f.recording, "header = false\n", ""); }, 3,
     "expected header = false in recording.toml"},
    {"header_denied", [](Files& f) { replace(f.recording, "\"ms\"\n", "\"ms\"\nheader = false\n"); }, 3,
     "expected the column's number"},
    {"header_read_as_a_row", [](Files& f) { f.log = "t,x,y,h,l,r\n" + f.log; }, 3,
     "expected numbers in the first line, or header = true"},
    {"forgotten_time_unit", [](Files& f) { replace(f.recording, "time_unit = \"ms\"\n", ""); }, 3,
     "expected time_unit = \"ms\""},
    {"wrong_time_unit", [](Files& f) { replace(f.recording, "\"ms\"", "\"ns\""); }, 3,
     "expected time_unit = \"ms\""},
    {"gyro_in_degrees",
     [](Files& f) { replace(f.recording, "{ column = \"rate\", unit = \"deg/s\" }", "\"rate\""); }, 0,
     "write unit = \"deg/s\""},
    {"heading_in_degrees_denied",
     [](Files& f) { replace(f.recording, "rad = 4", "rad = { column = 4, unit = \"deg\" }"); }, 0,
     "leave out unit = \"deg\""},
    {"stray_wheel", [](Files& f) { replace(f.recording, "left_ticks", "lft_ticks"); }, 0,
     "no wheel 'lft', so that column is not used: is 'left' meant?"},
    {"stray_key", [](Files& f) { replace(f.recording, "heading_rad", "headng_rad"); }, 3,
     "unknown key 'headng_rad'; expected 'heading_rad'"},
    {"columns_forgotten", [](Files& f) { replace(f.recording, "columns.left_ticks", "left_ticks"); }, 3,
     "unknown key 'left_ticks'; expected 'columns.left_ticks'"},
    {"stray_table", [](Files& f) { replace(f.recording, "[gyro]", "[imu]"); }, 3, "unknown key 'imu'"},
    {"wrong_column", [](Files& f) { replace(f.recording, "right_ticks = 6", "right_ticks = 3"); }, 0,
     "right_ticks holds fractions", false},
    {"column_beyond", [](Files& f) { replace(f.recording, "right_ticks = 6", "right_ticks = 9"); }, 3,
     "expected a number from 1 to 6"},
    {"swapped_wheels",
     [](Files& f) {
       replace(f.recording, "left_ticks = 5", "left_ticks = 6");
       replace(f.recording, "right_ticks = 6", "right_ticks = 5");
     },
     0, "look swapped"},
    {"reversed_wheel", [](Files& f) { replace(f.robot, "1000", "-1000"); }, 0, "'left' counts backwards"},
    {"reversed_wheel_without_reference",
     [](Files& f) {
       f.recording.erase(f.recording.find("[reference]"),
                         f.recording.find("[gyro]") - f.recording.find("[reference]"));
       replace(f.robot, "1000", "-1000");
     },
     0, "'left' counts backwards: ticks_per_revolution = 1000"},
    {"track_for_half_of_it",
     [](Files& f) {
       f.recording.erase(f.recording.find("[reference]"),
                         f.recording.find("[gyro]") - f.recording.find("[reference]"));
       replace_all(f.robot, "y_m = 0.1", "y_m = 0.2");
       replace_all(f.robot, "y_m = -0.1", "y_m = -0.2");
     },
     0, "check y_m (half the track)"},
    {"wrapping_counter",
     [](Files& f) {
       std::string log;
       for (int row = 0; row < 1200; ++row)
         log += fmt::format("{:.2f},0,0,0,{},{}\n", 0.05 * row, (65000 + 20 * row) % 65536,
                            (100 + 20 * row) % 65536);
       f.log = log;
       f.recording =
           "[wheels]\nfile = \"log.csv\"\nheader = false\ncolumns = { time_s = 1, left_ticks = 5, "
           "right_ticks = 6 }\n";
     },
     0, "the counter of 'left' wraps like one of 16 bits: write tick_bits = 16"},
    {"offset_in_both_files",
     [](Files& f) {
       replace(f.recording, "\"ms\"\n", "\"ms\"\ntime_offset_s = 0.03\n");
       f.robot += "time_offset_s = 0.02\n";
     },
     0, "time_offset_s stands in both mine/recording.toml (0.0300) and mine.toml (0.0200), and they add up"},
    {"offset_in_the_recording",
     [](Files& f) { replace(f.recording, "\"ms\"\n", "\"ms\"\ntime_offset_s = 0.04\n"); }, 0,
     "under [gyro] in mine/recording.toml"},
    {"bias_in_degrees", [](Files& f) { f.robot += "bias_rad_s = 0.5\n"; }, 0, "write bias_rad_s = "},
    {"offset_in_the_robot", [](Files& f) { f.robot += "time_offset_s = 0.04\n"; }, 0,
     "under [gyro] in mine.toml"},
    {"gears_forgotten", [](Files& f) { replace_all(f.robot, "1000", "100"); }, 0,
     "check ticks_per_revolution, gears and diameters"},
    {"counts_of_the_motor", [](Files& f) { replace_all(f.robot, "1000", "30"); }, 0,
     "check ticks_per_revolution, gears and diameters"},
    {"counts_that_nothing_scales",
     [](Files& f) { replace_all(f.robot, "ticks_per_revolution = 1000\n", ""); }, 0,
     "mine.toml:2: ticks_per_revolution: 'left' and 'right' have no ticks_per_revolution"},
    {"diameter_in_mm", [](Files& f) { replace(f.robot, "diameter_m = 0.1", "diameter_m = 100"); }, 3,
     "expected metres above 0"},
    {"robot_key", [](Files& f) { replace(f.robot, "y_m", "y"); }, 3, "unknown key 'y'; expected 'y_m'"},
    {"one_bracket", [](Files& f) { replace_all(f.robot, "[[wheel]]", "[wheel]"); }, 3,
     "two brackets, like [[wheel]]"},
    {"semicolons", [](Files& f) { replace_all(f.log, ",", ";"); }, 3, "expected delimiter = \";\""},
    {"tabs", [](Files& f) { replace_all(f.log, ",", "\t"); }, 3, "expected delimiter = \"\\t\""},
    {"decimal_commas",
     [](Files& f) {
       replace_all(f.log, ",", ";");
       replace_all(f.log, ".", ",");
       replace_all(f.recording, "header = false\n", "header = false\ndelimiter = \";\"\n");
     },
     3, "decimal = \",\" in recording.toml"},
    {"decimal_commas_told",
     [](Files& f) {
       replace_all(f.log, ",", ";");
       replace_all(f.log, ".", ",");
       replace_all(f.recording, "header = false\n", "header = false\ndelimiter = \";\"\ndecimal = \",\"\n");
     },
     0, ""},
    {"words_before_the_table", [](Files& f) { f.log = "Robot log v1.2\nmade by hand\n" + f.log; }, 3,
     "expected skip_lines = 2 in recording.toml"},
    {"words_before_the_table_told",
     [](Files& f) {
       f.log = "Robot log v1.2\nmade by hand\n" + f.log;
       replace_all(f.recording, "header = false\n", "header = false\nskip_lines = 2\n");
     },
     0, ""},
    {"no_clock",
     [](Files& f) {
       std::string log;
       for (int row = 0; row < 1200; ++row) log += line(f.log, (599 * row) % 1200);
       f.log = log;
     },
     0, "is this the column of the stamps?", false},
    {"byte_order_mark", [](Files& f) { f.log = "\xEF\xBB\xBF" + f.log; }, 0, ""},
    {"windows_lines", [](Files& f) { replace_all(f.log, "\n", "\r\n"); }, 0, ""},
    {"unquoted_text", [](Files& f) { replace(f.recording, "\"imu.csv\"", "imu.csv"); }, 3, "text in quotes"},
    {"repeated_stamp", [](Files& f) { f.log += line(f.log, 1199); }, 0,
     "1 row with the stamp of the row before"},
    {"back_in_time", [](Files& f) { f.log += line(f.log, 10); }, 0, "time steps back 1 time"},
    {"cells_without_a_number", [](Files& f) { replace(f.imu, line(f.imu, 100), "4950,NaN\n"); }, 0,
     "1 cell without a number: not measured", false},
    {"missing_file", [](Files& f) { replace(f.recording, "imu.csv", "imu2.csv"); }, 3,
     "the file 'imu2.csv' does not exist"},
    {"empty_file", [](Files& f) { f.imu.clear(); }, 3, "is empty"},
    {"other_clock", [](Files& f) { replace(f.recording, "\"ms\"\n", "\"ms\"\ntime_offset_s = 1e6\n"); }, 0,
     "never at the same time"},
};

void PrintTo(const Mistake& mistake, std::ostream* stream) {
  *stream << mistake.name;
}

class Newcomer : public testing::TestWithParam<Mistake> {};

TEST_P(Newcomer, GetsOneLine) {
  const Mistake& mistake = GetParam();
  Files files = drive();
  mistake.make(files);
  const Sample sample;
  write_file(sample.folder() / "mine/log.csv", files.log);
  write_file(sample.folder() / "mine/imu.csv", files.imu);
  write_file(sample.folder() / "mine/recording.toml", files.recording);
  write_file(sample.folder() / "mine.toml", files.robot);
  const Outcome outcome = run_program(sample.folder(), {"info", "mine", "--robot", "mine.toml"});
  EXPECT_EQ(outcome.exit_code, mistake.exit_code) << outcome.err;
  if (mistake.exit_code != 0) {
    EXPECT_THAT(outcome.err, HasSubstr(mistake.words));
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    return;
  }
  EXPECT_THAT(outcome.err, IsEmpty());
  if (std::string_view(mistake.words).empty()) {
    EXPECT_THAT(outcome.out, HasSubstr("problems: none found"));
    return;
  }
  std::size_t warnings = 0;
  for (std::size_t at = outcome.out.find("\n  warning: "); at != std::string::npos;
       at = outcome.out.find("\n  warning: ", at + 1))
    ++warnings;
  EXPECT_TRUE(warnings == 1 || !mistake.alone) << outcome.out;
  const std::size_t first = outcome.out.find("\n  warning: ") + 1;
  EXPECT_THAT(outcome.out.substr(first, outcome.out.find('\n', first) - first), HasSubstr(mistake.words))
      << outcome.out;
}

INSTANTIATE_TEST_SUITE_P(, Newcomer, testing::ValuesIn(kMistakes),
                         [](const auto& one) { return std::string(one.param.name); });

/// Files of somebody who starts, in the folder of a sample.
void put(const Files& files, const std::filesystem::path& folder) {
  write_file(folder / "mine/log.csv", files.log);
  write_file(folder / "mine/imu.csv", files.imu);
  if (!files.recording.empty()) write_file(folder / "mine/recording.toml", files.recording);
  write_file(folder / "mine.toml", files.robot);
}

Outcome run_of(const Files& files, const Sample& sample) {
  put(files, sample.folder());
  return run_program(sample.folder(), {"run", "mine", "--robot", "mine.toml", "-o", "d"});
}

TEST(NewcomersFolder, WithoutRecordingTomlSaysWhichTablesAreThereAndWhatIsMissing) {
  Files files = drive();
  files.recording.clear();
  const Sample sample;
  put(files, sample.folder());
  for (const Arguments& command :
       {Arguments{"info", "mine"}, Arguments{"calibrate", "mine", "--robot", "mine.toml", "-o", "c.toml"},
        Arguments{"odometry", "mine", "--robot", "mine.toml"},
        Arguments{"run", "mine", "--robot", "mine.toml", "-o", "d"}}) {
    const Outcome outcome = run_program(sample.folder(), command);
    EXPECT_EQ(outcome.exit_code, 3);
    EXPECT_EQ(
        outcome.err,
        "trundle: mine: holds no recording: imu.csv, log.csv are there, but no recording.toml; expected "
        "mine/recording.toml, which says what their columns are: docs/getting-started.md shows one, "
        "docs/recording.md has all its keys\n");
  }
}

TEST(NewcomersFolder, MissingFilesNameTheCommandThatWritesThem) {
  const Sample sample;
  put(drive(), sample.folder());
  const Outcome robot = run_program(sample.folder(), {"odometry", "mine", "--robot", "calibrated.toml"});
  EXPECT_EQ(robot.exit_code, 3);
  EXPECT_THAT(robot.err, HasSubstr("calibrated.toml: does not exist; expected a robot file"));
  EXPECT_THAT(robot.err, HasSubstr("`trundle calibrate RECORDING --robot NOMINAL -o calibrated.toml`"));
  const Outcome trajectory = run_program(sample.folder(), {"evaluate", "t.csv", "mine"});
  EXPECT_EQ(trajectory.exit_code, 3);
  EXPECT_THAT(trajectory.err, HasSubstr("`trundle odometry RECORDING --robot ROBOT -o t.csv`"));
}

TEST(NewcomersFolder, FaultsOfTheRobotNameItsFile) {
  Files files = drive();
  const Sample sample;
  put(files, sample.folder());
  const Outcome blind = run_program(sample.folder(), {"slam", "mine", "--robot", "mine.toml", "-o", "map"});
  EXPECT_EQ(blind.exit_code, 3);
  EXPECT_THAT(blind.err, HasSubstr("mine.toml: has no landmark sensor"));
  replace_all(files.robot, "ticks_per_revolution = 1000\n", "");
  put(files, sample.folder());
  const Outcome unscaled = run_program(sample.folder(), {"odometry", "mine", "--robot", "mine.toml"});
  EXPECT_EQ(unscaled.exit_code, 3);
  EXPECT_THAT(unscaled.err, HasSubstr("mine.toml:2: the wheel 'left' has no ticks_per_revolution"));
}

TEST(NewcomersFolder, AWheelThatIsNotRecordedLeavesNothingToTell) {
  Files files = drive();
  replace(files.recording, "left_ticks", "l_ticks");
  replace_all(files.robot, "= 1000\n", "= 1000\ntick_bits = 16\n");
  replace(files.recording, "increments = true\n", "");
  files.log.clear();
  for (int row = 0; row < 1200; ++row)
    files.log += fmt::format("{:.2f},0,0,0,{},{}\n", 0.05 * row, (65000 + 20 * row) % 65536,
                             (65000 + 20 * row) % 65536);
  const Sample sample;
  put(files, sample.folder());
  const Outcome outcome = run_program(sample.folder(), {"info", "mine", "--robot", "mine.toml"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("the robot file has no wheel 'l'"));
  EXPECT_THAT(outcome.out, HasSubstr("the counter of 'right' wraps 1 time\n"));
  EXPECT_THAT(outcome.out, Not(HasSubstr("this robot can tell:")));
  EXPECT_THAT(outcome.out, HasSubstr("anything with this recording"));
}

TEST(Program, NamesACommandThatIsMisspelt) {
  const Sample sample;
  const Outcome near = run_program(sample.folder(), {"calibrat", "cw"});
  EXPECT_EQ(near.exit_code, 2);
  EXPECT_EQ(near.err, "trundle: unknown command 'calibrat'; expected 'calibrate'\n");
  EXPECT_EQ(run_program(sample.folder(), {"frobnicate"}).err,
            "trundle: unknown command 'frobnicate'; --help names all\n");
}

/// A file with a stray key under one of its tables after the other: each must be named, with its line.
void expect_stray_keys_named(const std::filesystem::path& folder, const std::string& name,
                             const Arguments& command) {
  const std::string text = read_file(folder / name);
  int tables = 0, number = 1;
  for (std::size_t at = 0; at < text.size(); ++number) {
    const std::size_t end = text.find('\n', at) + 1;
    if (text[at] == '[') {
      ++tables;
      write_file(folder / name, text.substr(0, end) + "stray_key = 1\n" + text.substr(end));
      const Outcome outcome = run_program(folder, command);
      EXPECT_EQ(outcome.exit_code, 3) << text.substr(at, end - at);
      EXPECT_THAT(outcome.err, HasSubstr(fmt::format("{}:{}: ", name, number + 1)));
      EXPECT_THAT(outcome.err, HasSubstr("unknown key 'stray_key'")) << text.substr(at, end - at);
    }
    at = end;
  }
  EXPECT_GT(tables, 2);
  write_file(folder / name, text);
}

TEST(StrayKeys, AreNamedInEveryTableOfEveryFile) {
  const std::filesystem::path demo = std::filesystem::path(TRUNDLE_SOURCE_DIR) / "data/demo";
  const Files files = drive();
  const Sample sample;
  const std::filesystem::path& folder = sample.folder();
  write_file(folder / "log.csv", files.log);
  write_file(folder / "imu.csv", files.imu);
  write_file(folder / "recording.toml", files.recording);
  write_file(folder / "mine.toml", files.robot);
  expect_stray_keys_named(folder, "recording.toml", {"info", "."});
  write_file(folder / "robot.toml",
             read_file(demo / "robot.toml") + "[wheels]\ntime_offset_s = 0\n[reference_sensor]\nx_m = 0\n");
  write_file(folder / "scenario.toml", read_file(demo / "scenario.toml"));
  write_file(folder / "slip.toml", read_file(demo / "slip.toml"));
  expect_stray_keys_named(folder, "robot.toml", {"info", ".", "--robot", "robot.toml"});
  expect_stray_keys_named(folder, "scenario.toml", {"simulate", "scenario.toml", "-o", "d"});
  expect_stray_keys_named(folder, "slip.toml", {"simulate", "slip.toml", "-o", "d"});
  ASSERT_EQ(
      run_program(folder, {"calibrate", ".", "--robot", "mine.toml", "-o", "calibrated.toml"}).exit_code, 0);
  expect_stray_keys_named(folder, "calibrated.toml", {"info", ".", "--robot", "calibrated.toml"});
}

/// What `run` tells on the way: what is wrong in full, and every number with its ±.
TEST(NewcomersRun, PrintsWarningsAndInconsistencies) {
  const Files files = drive();
  const Sample sample;
  write_file(sample.folder() / "mine/log.csv", files.log);
  write_file(sample.folder() / "mine/imu.csv", files.imu);
  write_file(sample.folder() / "mine/recording.toml", files.recording);
  std::string robot = files.robot;
  replace_all(robot, "1000", "100");
  write_file(sample.folder() / "mine.toml", robot);
  const Outcome outcome = run_program(sample.folder(), {"run", "mine", "--robot", "mine.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("warning: mine/log.csv: the reference moves"));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("left.diameter 0\\.[0-9]+ ± [0-9.]+ m \\(was 0.1\\)"));
}

/// Misread, nothing follows: numbers of it would look like results.
TEST(NewcomersRun, TellsNothingOfWhatIsMisread) {
  Files files = drive();
  replace(files.recording, "increments = true\n", "");
  const Sample sample;
  const Outcome outcome = run_of(files, sample);
  EXPECT_EQ(outcome.exit_code, 4) << outcome.out;
  EXPECT_THAT(outcome.out, testing::ContainsRegex("odometry +failed +not done: mine/recording.toml:1: "));
  EXPECT_THAT(outcome.err, HasSubstr("write increments = true under [wheels]"));
  EXPECT_FALSE(std::filesystem::exists(sample.folder() / "d")) << "a run that fails leaves nothing";
}

/// Wrong signs make a wrong path, too, unless a calibration puts them right.
TEST(NewcomersRun, TellsNothingOfAWheelThatNobodyTurnsRound) {
  Files files = drive();
  files.recording.erase(files.recording.find("[reference]"),
                        files.recording.find("[gyro]") - files.recording.find("[reference]"));
  replace(files.robot, "1000", "-1000");
  const Sample sample;
  const Outcome outcome = run_of(files, sample);
  EXPECT_EQ(outcome.exit_code, 4) << outcome.out;
  EXPECT_THAT(outcome.out, testing::ContainsRegex("odometry +failed +not done: .*'left' counts backwards"));
  EXPECT_FALSE(std::filesystem::exists(sample.folder() / "d"));
}

TEST(NewcomersRun, GoesOnWithAWheelThatTheCalibrationTurnsRound) {
  Files files = drive();
  replace(files.robot, "1000", "-1000");
  const Sample sample;
  const Outcome outcome = run_of(files, sample);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("'left' counts backwards: ticks_per_revolution = 1000; already"));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("odometry +done "));
}

/// A reference in the wrong unit does not make the odometry wrong.
TEST(NewcomersRun, StillTellsWhatTheMisreadingDoesNotTouch) {
  Files files = drive();
  replace(files.recording, "rad = 4", "rad = { column = 4, unit = \"deg\" }");
  const Sample sample;
  const Outcome outcome = run_of(files, sample);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::ContainsRegex("calibration +failed +not done: "));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("odometry +done "));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("evaluation +failed +not done: "));
}

/// Nor is anything learned from other recordings that are misread.
TEST(NewcomersRun, LearnsNothingFromOthersThatAreMisread) {
  const Sample sample;
  put(drive(), sample.folder());
  std::filesystem::copy(sample.folder() / "mine", sample.folder() / "other");
  Files files = drive();
  replace(files.recording, "rad = 4", "rad = { column = 4, unit = \"deg\" }");
  write_file(sample.folder() / "other/recording.toml", files.recording);
  const Outcome outcome = run_program(
      sample.folder(), {"run", "mine", "--robot", "mine.toml", "--calibrate-on", "other", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, testing::ContainsRegex("calibration +failed +not done: other/"));
  EXPECT_THAT(outcome.out, testing::ContainsRegex("odometry +done "));
}

/// What run has corrected itself is no task for the user.
TEST(NewcomersRun, NotesTheOffsetThatItCorrected) {
  Files files = drive();
  files.robot += "time_offset_s = 0.3\n";
  const Sample sample;
  const Outcome outcome = run_of(files, sample);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("note: corrected: gyro.time_offset_s "));
  EXPECT_THAT(outcome.out, Not(HasSubstr("write time_offset_s")));
  const Outcome again =
      run_program(sample.folder(), {"run", "mine", "--robot", "d/calibrated.toml", "-o", "e"});
  EXPECT_THAT(again.out, Not(HasSubstr("write time_offset_s")));
}

/// Results do not go where the recording is.
TEST(NewcomersFolder, IsNotWrittenOver) {
  const Files files = drive();
  const Sample sample;
  put(files, sample.folder());
  for (const Arguments& command :
       {Arguments{"odometry", "mine", "--robot", "mine.toml", "-o", "mine/log.csv"},
        Arguments{"slip", "mine", "--robot", "mine.toml", "-o", "slip.csv", "--corrected", "mine/imu.csv"},
        Arguments{"run", "mine", "--robot", "mine.toml", "-o", "mine"},
        Arguments{"run", "mine", "--robot", "mine.toml", "-o", "./mine/../mine"}}) {
    const Outcome outcome = run_program(sample.folder(), command);
    EXPECT_EQ(outcome.exit_code, 3) << command.front();
    EXPECT_THAT(outcome.err, HasSubstr("is part of a recording, which would be lost"));
  }
  EXPECT_EQ(read_file(sample.folder() / "mine/log.csv"), files.log);
  EXPECT_EQ(read_file(sample.folder() / "mine/imu.csv"), files.imu);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(sample.folder() / "mine"), {}), 3);
}

/// The offset of a clock looks like slip, so `slip` names it.
TEST(NewcomersSlip, NamesTheOffsetOfAClock) {
  Files files = drive();
  files.robot += "time_offset_s = 0.3\n";
  const Sample sample;
  put(files, sample.folder());
  const Outcome outcome = run_program(sample.folder(), {"slip", "mine", "--robot", "mine.toml"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_THAT(outcome.out, HasSubstr("too late against the wheels', which looks like slip"));
}

TEST(NewcomersCalibration, NamesAGyroThatTheRobotFileHasNot) {
  Files files = drive();
  replace(files.robot, "[gyro]\n", "");
  const std::size_t reference = files.recording.find("[reference]");
  files.recording.erase(reference, files.recording.find("[gyro]") - reference);
  const Sample sample;
  put(files, sample.folder());
  const Outcome outcome =
      run_program(sample.folder(), {"calibrate", "mine", "--robot", "mine.toml", "-o", "c.toml"});
  EXPECT_EQ(outcome.exit_code, 4) << outcome.out;
  EXPECT_THAT(outcome.err, HasSubstr("the robot file has no [gyro] although the recording has one"));
}

// Three tenths of a second, in which a wheel counts one tick, and motions that one turning rate explains.
TEST(NewcomersCalibration, IsNotSureOfWhatLeavesNoResiduals) {
  const Sample sample;
  std::string wheels = "time_s,w0_ticks,w1_ticks\n", reference = "time_s,x_m,y_m,heading_rad\n";
  std::string relative = "start_s,end_s,dx_m,dy_m,dheading_rad\n";
  for (int i = 0; i < 30; ++i) wheels += fmt::format("{:.2f},0,{}\n", 0.01 * i, -(i / 20));
  for (int i = 0; i < 15; ++i)
    reference += fmt::format("{:.2f},{:.3f},0,{:.2f}\n", 0.02 * i, 0.013 * i, -0.03 * i);
  for (int i = 0; i < 9; ++i)
    relative += fmt::format("{:.2f},{:.2f},0.02,0,-0.045\n", 0.03 * i, 0.03 * (i + 1));
  write_file(sample.folder() / "short/wheels.csv", wheels);
  write_file(sample.folder() / "short/reference.csv", reference);
  write_file(sample.folder() / "short/relative.csv", relative);
  write_file(sample.folder() / "short.toml", R"([[wheel]]
name = "w0"
y_m = 0.141
diameter_m = 0.0515
ticks_per_revolution = 12
[[wheel]]
name = "w1"
y_m = -0.141
diameter_m = 0.0515
ticks_per_revolution = 12
[gyro]
)");
  const Outcome outcome =
      run_program(sample.folder(), {"calibrate", "short", "--robot", "short.toml", "-o", "c.toml"});
  EXPECT_EQ(outcome.exit_code, 4) << outcome.out;
  EXPECT_THAT(outcome.err, HasSubstr("of which nothing is sure"));
  EXPECT_FALSE(std::filesystem::exists(sample.folder() / "c.toml"));
}

TEST(NewcomersRun, FindsNoMotionInOneRow) {
  Files files = drive();
  files.log = line(files.log, 0);
  const Sample sample;
  write_file(sample.folder() / "mine/log.csv", files.log);
  write_file(sample.folder() / "mine/imu.csv", files.imu);
  write_file(sample.folder() / "mine/recording.toml", files.recording);
  write_file(sample.folder() / "mine.toml", files.robot);
  const Outcome outcome = run_program(sample.folder(), {"run", "mine", "--robot", "mine.toml", "-o", "d"});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_THAT(outcome.err, HasSubstr("there is no motion to integrate"));
}

TEST(NewcomersRun, SaysOnceWhatTheRunsCannotShow) {
  Files files = drive();
  files.log.resize(files.log.find('\n', 1000) + 1);  // it has not moved yet
  const Sample sample;
  write_file(sample.folder() / "mine/log.csv", files.log);
  write_file(sample.folder() / "mine/imu.csv", files.imu);
  write_file(sample.folder() / "mine/recording.toml", files.recording);
  replace(files.robot, "[gyro]\n", "");
  write_file(sample.folder() / "mine.toml", files.robot);
  const Outcome outcome =
      run_program(sample.folder(), {"calibrate", "mine", "--robot", "mine.toml", "-o", "c.toml"});
  EXPECT_EQ(outcome.exit_code, 4) << outcome.out;
  EXPECT_EQ(
      outcome.err,
      "trundle: nothing can be estimated from these runs: left.diameter, right.diameter: not observable from "
      "these runs: drive straight ahead, and back; track: not observable from these runs: turn on the "
      "spot, or drive circles, both ways\n");
}

}  // namespace
}  // namespace trundle::test
