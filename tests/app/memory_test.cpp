// What a row of a long recording costs in memory.
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/file.hpp"
#include "trundle/io/pieces.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"

#ifndef __SANITIZE_ADDRESS__  // which keeps what was freed

namespace trundle::test {
namespace {

constexpr double kRate_hz = 500.0;

/// A robot that weaves, its wheels and its gyro at one rate.
void write_recording(const std::filesystem::path& folder, int rows) {
  const auto write = [&](const char* name, const char* header, const auto& cells) {
    io::write_file(folder / name, [&](const io::TakeText& take) {
      take(header);
      for (int row = 0; row < rows; ++row) take(fmt::format("{:.3f},{}\n", row / kRate_hz, cells(row)));
    });
  };
  const auto turned_rad = [](int row) { return 0.3 * std::sin(row / kRate_hz); };
  write("wheels.csv", "time_s,left_ticks,right_ticks\n", [&](int row) {
    const double way_m = 0.5 * row / kRate_hz, apart_m = 0.15 * turned_rad(row);
    return fmt::format("{:.0f},{:.0f}", 13000.0 * (way_m - apart_m), 13000.0 * (way_m + apart_m));
  });
  write("gyro.csv", "time_s,yaw_rate_rad_s\n",
        [&](int row) { return fmt::format("{:.6f}", 0.3 * std::cos(row / kRate_hz)); });
}

constexpr const char* kRobot = R"(name = "weaver"
[[wheel]]
name = "left"
y_m = 0.15
diameter_m = 0.1
ticks_per_revolution = 4096
[[wheel]]
name = "right"
y_m = -0.15
diameter_m = 0.1
ticks_per_revolution = 4096
[gyro]
noise_rad_s_sqrt_hz = 0.001
)";

/// More by a row: what the program itself takes, and what does not grow, cancels.
double bytes_per_row(const Arguments& arguments) {
  constexpr int kFew = 50'000, kMany = 200'000;
  const Sample sample;
  io::write_file(sample.folder() / "weaver.toml", std::string_view(kRobot));
  double bytes = 0.0;
  for (const int rows : {kFew, kMany}) {
    write_recording(sample.folder() / "long", rows);
    const Outcome outcome = run_program(sample.folder(), arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    bytes = static_cast<double>(outcome.peak_bytes) - bytes;
  }
  return bytes / (kMany - kFew);
}

// In a row of both files.
constexpr double kNumbers = 5.0 * sizeof(double);
// Of the allocator, and what is kept of intervals and windows of many rows: less than a column more.
constexpr double kOneMore = sizeof(double);
// What wheels and gyro have turned, while the gyro's clock is looked for; the rest is half a column.
constexpr double kWithTurns = 1.5 * kNumbers;
static_assert(kWithTurns - kNumbers == 2.5 * sizeof(double));

TEST(BytesPerRow, OdometryKeepsItsNumbers) {
  EXPECT_LT(bytes_per_row({"odometry", "long", "--robot", "weaver.toml", "-o", "t.csv"}),
            kNumbers + kOneMore);
}

TEST(BytesPerRow, InfoKeepsItsNumbersAndWhatIsTurned) {
  EXPECT_LT(bytes_per_row({"info", "long", "--robot", "weaver.toml"}), kWithTurns);
}

TEST(BytesPerRow, SlipKeepsItsNumbersAndWhatIsTurned) {
  EXPECT_LT(bytes_per_row({"slip", "long", "--robot", "weaver.toml", "-o", "s.csv"}), kWithTurns);
}

// An increment: its stamp, two wheels, the gyro's turn and its change.
constexpr double kIncrement = 5.0 * sizeof(double);
// The gyro's stream, for other offsets of its clock, and its turns while their changes are centred.
constexpr double kGyroAgain = 3.0 * sizeof(double);

// Of both wheels, how far they turned times the square of their speed: whether tyres grow is asked of each
// run.
constexpr double kSpeeds = 2.0 * sizeof(double);

TEST(BytesPerRow, CalibrateKeepsItsNumbersAndWhatTheyMean) {
  EXPECT_LT(bytes_per_row({"calibrate", "long", "--robot", "weaver.toml", "-o", "c/calibrated.toml"}),
            kNumbers + kIncrement + kGyroAgain + kSpeeds + kOneMore);
}

}  // namespace
}  // namespace trundle::test

#endif
