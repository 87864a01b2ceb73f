// What is said of a drive does not depend on when its clock began: those of robots count from 1970. Rates are
// powers of two, so that stamps moved by 2^30 s are exact, and every other byte must be the same.
#include <cctype>
#include <filesystem>
#include <sstream>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "trundle/io/file.hpp"

#include "app/demo.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

constexpr double kEpoch_s = 1 << 30;

constexpr const char* kDrive = R"(name = "drive"
seed = 11
robot = "{}"
steering = "odometry"
[truth]
track_m = 0.306
[truth.gyro]
bias_rad_s = 0.012
[encoders]
rate_hz = 16
[gyro]
rate_hz = 32
[reference]
rate_hz = 4
position_sigma_m = 0.001
heading_sigma_deg = 0.1
[landmarks]
count = 12
box_x_m = 6
box_y_m = 6
spacing_m = 1
[[run]]
[run.sightings]
rate_hz = 2
[[run.path]]
drive = "pause"
duration_s = 4
[[run.path]]
drive = "tour"
length_m = 15
box_x_m = 5
box_y_m = 5
[[run.slip]]
wheel = "left"
start_s = 20
duration_s = 0.8
factor = 1.6
)";

/// A table's rows, the first number of each moved.
std::string moved(const std::string& table, double by_s) {
  std::istringstream lines(table);
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t comma = line.find(',');
    const bool is_row =
        !line.empty() && (std::isdigit(static_cast<unsigned char>(line[0])) || line[0] == '-');
    result += is_row ? fmt::format("{}{}", std::stod(line) + by_s, line.substr(comma)) : line;
    result += '\n';
  }
  return result;
}

/// Without the lines that name and hash the files it was made of.
std::string rows_of(const std::string& table) {
  return table.substr(table.find("time_s"));
}

class Epoch : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(early_);
    write_file(early_ / "drive.toml", fmt::format(fmt::runtime(kDrive), kDemoRobot));
    ASSERT_EQ(run_program(early_, {"simulate", "drive.toml", "-o", "drive"}).exit_code, 0);
    std::filesystem::copy(early_, late_, std::filesystem::copy_options::recursive);
    for (const char* table : {"wheels.csv", "gyro.csv", "sightings.csv", "reference.csv"}) {
      const std::filesystem::path file = late_ / "drive" / table;
      write_file(file, moved(read_file(file), kEpoch_s));
    }
  }

  const Sample sample_;
  const std::filesystem::path early_ = sample_.folder() / "early", late_ = sample_.folder() / "late";
};

TEST_F(Epoch, NoByteOfWhatIsSaidDependsOnIt) {
  const std::string robot = kDemoRobot, map = "drive/landmarks.csv";
  for (const Arguments& arguments : {Arguments{"info", "drive"},
                                     {"odometry", "drive", "--robot", robot, "-o", "odometry.csv"},
                                     {"calibrate", "drive", "--robot", robot, "-o", "calibrated.toml"},
                                     {"slam", "drive", "--robot", robot, "-o", "slam"},
                                     {"run", "drive", "--robot", robot, "--map", map, "-o", "run"}}) {
    SCOPED_TRACE(arguments.front());
    const Outcome early = run_program(early_, arguments), late = run_program(late_, arguments);
    EXPECT_EQ(early.exit_code, 0) << early.err;
    EXPECT_EQ(early.out, late.out);
    EXPECT_EQ(early.err, late.err);
  }
  for (const char* table :
       {"odometry.csv", "slam/trajectory.csv", "run/trajectory.csv", "run/localization.csv"}) {
    SCOPED_TRACE(table);
    EXPECT_EQ(moved(rows_of(read_file(early_ / table)), kEpoch_s),
              moved(rows_of(read_file(late_ / table)), 0.0));
  }
}

}  // namespace
}  // namespace trundle::test
