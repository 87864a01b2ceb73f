// Commands where a gyro is there and tells nothing.
#include <array>
#include <cmath>
#include <sstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/file.hpp"

#include "app/demo.hpp"
#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

constexpr double kEnd_s = 30.0;  // of the tour what is kept: enough to calibrate and to map

/// What stands instead of a reading; empty: a lost one.
using Spoiled = std::string (*)(double time_s, double rate_rad_s);

struct BrokenGyro {
  const char* name;
  Spoiled spoiled;
};

constexpr std::array kBrokenGyros = {
    BrokenGyro{"NeverAReading", [](double, double) { return std::string(); }},
    BrokenGyro{"CountsOfTheSensor",
               [](double, double rate) { return fmt::format("{}", 16384.0 * rate + 3000.0); }},
    BrokenGyro{"BurstsWithGaps",
               [](double time, double rate) {
                 return std::fmod(time, 2.0) < 0.1 ? fmt::format("{}", rate) : std::string();
               }},
};

class UnusableGyro : public testing::TestWithParam<BrokenGyro> {
 protected:
  void SetUp() override {
    std::filesystem::copy(kDemo / "session_02/tour", sample_.folder() / "tour");
    for (const char* const stream : {"wheels", "reference", "sightings"})
      change(stream, [](auto& row) { return row; });
    change("gyro", [](const std::string& row) {
      const auto rate = row.find(',') + 1;
      return row.substr(0, rate) + GetParam().spoiled(std::stod(row), std::stod(row.substr(rate)));
    });
  }
  /// Every row of a stream until the end that is kept.
  template <typename Change>
  void change(const std::string& stream, const Change& changed) const {
    const std::filesystem::path file = sample_.folder() / "tour" / (stream + ".csv");
    std::istringstream rows(read_file(file));
    std::string text;
    for (std::string row; std::getline(rows, row);) {
      const bool is_reading = !row.starts_with('#') && !row.starts_with("time_s");
      if (is_reading && std::stod(row) > kEnd_s) break;
      text += (is_reading ? changed(row) : row) + '\n';
    }
    write_file(file, text);
  }
  Outcome run(const Arguments& arguments) const { return run_program(sample_.folder(), arguments); }

  Sample sample_;
};

TEST_P(UnusableGyro, EndsWithResultsOrAReason) {
  for (const Arguments& command :
       {Arguments{"info", "tour"}, Arguments{"calibrate", "tour", "-o", "robot.toml"},
        Arguments{"odometry", "tour", "-o", "odometry.csv"}, Arguments{"slip", "tour", "-o", "slip.csv"},
        Arguments{"slam", "tour", "-o", "map"}, Arguments{"run", "tour", "-o", "results"}}) {
    Arguments arguments = command;
    arguments.insert(arguments.end(), {"--robot", kDemoRobot});
    const Outcome outcome = run(arguments);
    EXPECT_THAT(outcome.exit_code, testing::AnyOf(0, 4)) << command.front() << ": " << outcome.err;
    EXPECT_THAT(outcome.out + outcome.err, testing::HasSubstr("gyro")) << command.front();
  }
}

INSTANTIATE_TEST_SUITE_P(, UnusableGyro, testing::ValuesIn(kBrokenGyros),
                         [](const testing::TestParamInfo<BrokenGyro>& of) {
                           return std::string(of.param.name);
                         });

}  // namespace
}  // namespace trundle::test
