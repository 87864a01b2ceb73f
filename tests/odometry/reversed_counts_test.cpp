// Encoders whose counts fall as their wheels roll ahead.
#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/odometry/integrate.hpp"

#include "sensed_drive.hpp"

namespace trundle::odometry {
namespace {

using test::SensedDrive;

Robot reversed(Robot robot) {
  for (std::size_t i = 0; i < robot.chassis.wheels().size(); ++i) {
    double& ticks = robot.chassis.wheel_storage[i].ticks_per_revolution;
    ticks = -ticks;
  }
  return robot;
}

struct CountedDrive {
  Recording as_is;
  Recording negated;
};

/// Rests of several lengths behind motions of several speeds. Every other row may lack the count of one
/// wheel: what is between its neighbours, which is no whole count, stands in.
CountedDrive counted_drive(bool with_empty_cells, std::uint64_t seed) {
  const Robot robot = test::robot_with_gyro();
  SensedDrive drive(test::with_bias(robot, 0.01), 20.0, seed);
  std::vector<Increment> increments = drive.over({{3.0},
                                                  {2.0, 0.2, 0.3},
                                                  {0.2, 0.05, 0.0},
                                                  {2.0},
                                                  {1.0, 0.003, 0.0},
                                                  {1.5},
                                                  {2.0, -0.1, -0.5},
                                                  {4.0},
                                                  {1.0, 0.02, 0.04},
                                                  {2.5}});
  CountedDrive counted;
  Recording& recording = counted.as_is;
  recording.name = "drive";
  double counts[2] = {0.0, 0.0};
  for (const std::string& name : robot.wheel_names)
    recording.wheels.series.push_back({name, WheelUnit::ticks, {0.0}});
  recording.wheels.time_s = recording.gyro.time_s = {0.0};
  recording.gyro.yaw_rate_rad_s = {0.0};
  for (std::size_t k = 0; k < increments.size(); ++k) {
    const Increment& increment = increments[k];
    recording.wheels.time_s.push_back(increment.time_s);
    recording.gyro.time_s.push_back(increment.time_s);
    recording.gyro.yaw_rate_rad_s.push_back(increment.gyro_rad / increment.duration_s);
    for (std::size_t i = 0; i < 2; ++i) {
      counts[i] += std::round(increment.turned[i] * robot.chassis.wheels()[i].ticks_per_revolution);
      recording.wheels.series[i].value.push_back(counts[i]);
    }
  }
  if (with_empty_cells)
    for (std::size_t k = 1; k + 1 < recording.wheels.time_s.size(); k += 2)
      recording.wheels.series[k % 4 < 2 ? 0 : 1].value[k] = kNotMeasured;
  counted.negated = recording;
  for (WheelSeries& series : counted.negated.wheels.series)
    for (double& value : series.value) value = -value;
  return counted;
}

double rest_seen(const AlignedReadings& readings, Odometer& odometer) {
  double rest_s = 0.0;
  for (const Increment& increment : readings.increments)
    rest_s += odometer.step(increment).at_rest() ? increment.duration_s : 0.0;
  return rest_s;
}

/// They are the same drive, to the last bit: when the robot stood, too.
TEST(ReversedCounts, OfWheelsMountedTheOtherWayGiveTheSameDrive) {
  const Robot robot = test::robot_with_gyro();
  for (const bool with_empty_cells : {false, true})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      const CountedDrive counted = counted_drive(with_empty_cells, seed);
      Odometer ahead = test::learning(robot), back = test::learning(reversed(robot));
      const double rest_s = rest_seen(align(counted.as_is, robot), ahead);
      const double reversed_rest_s = rest_seen(align(counted.negated, reversed(robot)), back);
      std::printf("empty cells %d: rest %.2f and %.2f s, bias %.6f and %.6f rad/s\n",
                  with_empty_cells ? 1 : 0, rest_s, reversed_rest_s, ahead.gyro_bias().rad_s,
                  back.gyro_bias().rad_s);
      EXPECT_GT(rest_s, 5.0);
      EXPECT_EQ(reversed_rest_s, rest_s) << with_empty_cells << " " << seed;
      EXPECT_EQ(std::memcmp(&back.pose(), &ahead.pose(), sizeof(Pose2)), 0)
          << with_empty_cells << " " << seed;
      EXPECT_EQ(back.white_covariance(), ahead.white_covariance());
      EXPECT_EQ(back.gyro_bias().rad_s, ahead.gyro_bias().rad_s);
      EXPECT_EQ(back.gyro_bias().variance, ahead.gyro_bias().variance);
    }
}

}  // namespace
}  // namespace trundle::odometry
