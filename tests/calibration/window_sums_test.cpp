// Readings summed once over windows say what a pass over the readings says.
#include "trundle/calibration/likelihood/window_sums.hpp"

#include <gtest/gtest.h>

#include "trundle/calibration/likelihood/chassis_likelihood.hpp"

namespace trundle::calibration {
namespace {

Robot gyro_robot_of_sums() {
  Robot robot;
  robot.chassis = differential_drive({}, 0.4);
  robot.chassis.gyro = Gyro{};
  return robot;
}

/// 2.5 s at 10 Hz; the wheels turn alike but for a little more of the right one in each interval.
Run run_of_sums(std::size_t bridged, std::size_t without_gyro) {
  Run run;
  for (std::size_t i = 0; i < 25; ++i) {
    Increment increment{.time_s = 0.1 * static_cast<double>(i + 1), .duration_s = 0.1};
    increment.turned[0] = 1.0;
    increment.turned[1] = 1.0 + 1e-3 * static_cast<double>(i);
    increment.has_gyro = i != without_gyro;
    increment.gyro_rad = 1e-3;
    run.readings.increments.push_back(increment);
    run.readings.bridged.push_back(i == bridged);
  }
  return run;
}

TEST(WindowSums, AWindowEndsBeforeAGapAndWhereTheGyroIsMissing) {
  const Robot robot = gyro_robot_of_sums();
  for (const auto& run : {run_of_sums(16, 99), run_of_sums(99, 16)}) {
    const auto sums = window_sums(run, robot.chassis, 1.0);
    ASSERT_TRUE(sums);
    ASSERT_EQ(sums->windows.size(), 2U);  // a second, what is left before the gap; too little before the end
    EXPECT_NEAR(sums->windows[0].duration_s, 1.0, 1e-12);
    EXPECT_NEAR(sums->windows[1].duration_s, 0.6, 1e-12);
    EXPECT_NEAR(sums->windows[1].turned[0], 6.0, 1e-12);
    EXPECT_NEAR(sums->windows[1].turned[1], 6.0 + 1e-3 * (10 + 11 + 12 + 13 + 14 + 15), 1e-12);
    EXPECT_NEAR(sums->windows[1].gyro_rad, 6e-3, 1e-12);
    EXPECT_EQ(sums->parts_end, (std::vector<std::size_t>{10, 16}));
    EXPECT_EQ(sums->last, (std::vector<std::size_t>{9, 16}));
  }
}

TEST(WindowSums, LessThanHalfAWindowIsLeftOut) {
  const auto sums = window_sums(run_of_sums(14, 99), gyro_robot_of_sums().chassis, 1.0);
  ASSERT_TRUE(sums);
  EXPECT_EQ(sums->last, (std::vector<std::size_t>{9, 24}));  // not the 0.4 s before the gap
  EXPECT_EQ(sums->parts.size(), sums->parts_end.back());
}

TEST(WindowSums, ThereAreNoneWhereMotionExplainsAllReadings) {
  EXPECT_FALSE(window_sums(run_of_sums(99, 99), differential_drive({}, 0.4), 1.0));
}

TEST(WindowSums, TheLikelihoodOfGivenSumsIsThatOfTheReadings) {
  const Robot robot = gyro_robot_of_sums();
  const auto run = run_of_sums(16, 99);
  const auto sums = window_sums(run, robot.chassis, 1.0);
  ASSERT_TRUE(sums);
  const std::vector<Parameter> parameters = {kGyroBias};
  const auto own = chassis_likelihood(run, robot, parameters, {.blocks = 2});
  const auto given = chassis_likelihood(run, robot, parameters, {.blocks = 2, .sums = &*sums});
  ASSERT_EQ(own.size(), given.size());
  EXPECT_GT(own[0].count, 0);
  EXPECT_GT(own[1].count, 0);
  for (std::size_t i = 0; i < own.size(); ++i) {
    EXPECT_EQ(own[i].matrix, given[i].matrix);
    EXPECT_EQ(own[i].gradient, given[i].gradient);
    EXPECT_EQ(own[i].chi2, given[i].chi2);
  }
}

}  // namespace
}  // namespace trundle::calibration
