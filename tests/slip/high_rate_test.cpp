// Sensors that are read at 1 kHz are judged over intervals as long as those of others.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/simulation/scenario.hpp"
#include "trundle/slip/find_slip.hpp"

#include "slip/noisy_robots.hpp"

namespace trundle::slip {
namespace {

using test::noisy_differential;

constexpr int kSpinningWheel = 1;
constexpr TimeSpan kSpin{.start_s = 8.0, .duration_s = 2.0};

/// At 1 kHz.
Simulation spinning_drive() {
  Scenario scenario;
  scenario.nominal = scenario.truth = noisy_differential();
  scenario.steering = Steering::truth;
  scenario.path = joined({pause(3.0), straight(4.0), turn_on_the_spot(1.0), straight(1.0)});
  scenario.encoders.rate_hz = scenario.gyro.rate_hz = 1000.0;
  scenario.slips = {{.wheel = kSpinningWheel, .span = kSpin, .factor = 1.5}};
  scenario.seed = 5;
  return simulate(scenario);
}

/// The same counts, as they are read every so many milliseconds.
Recording read_every(int rows, Recording recording) {
  const auto thin = [&](std::vector<double>& values) {
    std::size_t row = 0;
    std::erase_if(values, [&](double) { return row++ % static_cast<std::size_t>(rows) != 0; });
  };
  for (WheelSeries& series : recording.wheels.series) thin(series.value);
  thin(recording.wheels.time_s);
  return recording;
}

SlipOdometer::Options judging_every(double interval_s) {
  SlipOdometer::Options options;
  options.odometry.learn_gyro_bias = true;
  options.slip.interval_s = interval_s;
  return options;
}

TEST(HighRate, IntervalsLastAsLongAsTheyAreAskedToBe) {
  const Recording recording = spinning_drive().recording;
  for (const int row_ms : {1, 10}) {
    const AlignedReadings readings = align(read_every(row_ms, recording), noisy_differential());
    for (const double interval_s : {0.25, 1.0}) {
      SlipOdometer odometer(noisy_differential(), judging_every(interval_s));
      double shortest_s = 1e9, longest_s = 0.0, last_s = 0.0;
      for (const Increment& increment : readings.increments) {
        last_s += increment.duration_s;
        if (!odometer.step(increment)) continue;
        shortest_s = std::min(shortest_s, last_s);
        longest_s = std::max(longest_s, last_s);
        last_s = 0.0;
      }
      std::printf("rows of %d ms, %.2f s: from %.4f to %.4f s\n", row_ms, interval_s, shortest_s, longest_s);
      const double half_row_s = 0.5e-3 * row_ms + 1e-9;
      EXPECT_GE(shortest_s, interval_s - half_row_s) << row_ms;
      EXPECT_LE(longest_s, interval_s + half_row_s) << row_ms;
    }
  }
}

TEST(HighRate, TheSameSlipIsFound) {
  const Robot robot = noisy_differential();
  const Simulation drive = spinning_drive();
  const Pose2& end = drive.truth.body.poses.back().pose;
  const double excess_m = drive.truth.slips.front().excess_m;
  for (const double interval_s : {0.25, 1.0}) {
    std::vector<SlipEvent> slips;
    std::vector<Pose2> ends;
    for (const int row_ms : {1, 10}) {
      const AlignedReadings readings = align(read_every(row_ms, drive.recording), robot);
      const SlipReport report = find_slip(readings, {}, robot, judging_every(interval_s).slip);
      ASSERT_EQ(clear_slips(report).size(), 1U) << row_ms << " " << interval_s;
      const SlipEvent& slip = slips.emplace_back(clear_slips(report).front());
      ends.push_back(report.end);
      const double off_m = std::hypot(report.end.x - end.x, report.end.y - end.y);
      std::printf("rows of %d ms, %.2f s: wheel %d from %.3f to %.3f s, %.4f ± %.4f m, end off by %.4f m\n",
                  row_ms, interval_s, slip.wheel, slip.start_s, slip.end_s, slip.excess_m,
                  slip.excess_sigma_m, off_m);
      EXPECT_EQ(slip.wheel, kSpinningWheel) << row_ms;
      EXPECT_EQ(slip.kind, SlipKind::spin) << row_ms;
      EXPECT_LE(slip.start_s, kSpin.start_s + interval_s) << row_ms;
      EXPECT_GE(slip.end_s, kSpin.end_s()) << row_ms;
      EXPECT_NEAR(slip.excess_m, excess_m, 4.0 * slip.excess_sigma_m) << row_ms;
      EXPECT_LT(off_m, 0.25 * excess_m) << row_ms;
    }
    EXPECT_NEAR(slips[0].start_s, slips[1].start_s, 1e-6) << interval_s;
    EXPECT_NEAR(slips[0].end_s, slips[1].end_s, 1e-6) << interval_s;
    EXPECT_NEAR(slips[0].excess_m, slips[1].excess_m, 0.1 * slips[1].excess_sigma_m) << interval_s;
    EXPECT_NEAR(slips[0].excess_sigma_m, slips[1].excess_sigma_m, 0.1 * slips[1].excess_sigma_m)
        << interval_s;
    // Increments of an interval that slips are integrated anew, at 1 kHz several of them as one.
    EXPECT_NEAR(ends[0].x, ends[1].x, 0.02 * excess_m) << interval_s;
    EXPECT_NEAR(ends[0].y, ends[1].y, 0.02 * excess_m) << interval_s;
  }
}

}  // namespace
}  // namespace trundle::slip
