// A gyro that falls silent while the robot stands: no wheel measures turning then.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "trundle/odometry/odometer.hpp"

#include "sensed_drive.hpp"

namespace trundle::odometry {
namespace {

using test::SensedDrive;

/// Wheels that are passive, at the middle's left and behind it; `lever_m` 0: none of them rolls as the robot
/// turns on the spot, so that a rest begins with the first interval in which the gyro reads no turn.
Robot pods_and_gyro(double lever_m) {
  const std::array<Pod, 2> pods{{{0.0, lever_m, 0.0}, {-lever_m, 0.0, 0.5 * kPi}}};
  return test::with_bias(
      test::robot_of(dead_wheels({.diameter_m = 0.05, .ticks_per_revolution = 2048}, pods, test::kGyro)),
      0.01);
}

/// By how much the heading moves in a silence of the gyro that begins so many rows after the robot stood for
/// 3 s behind a turn.
double heading_lost(const Robot& robot, double rate_hz, int rows, double silence_s) {
  SensedDrive drive(robot, rate_hz, 3);
  Odometer odometer = test::learning(test::with_bias(robot, 0.0));
  for (const Increment& increment : drive.over({{2.0}, {3.0, 0.0, 1.0}, {3.0}})) odometer.step(increment);
  for (int i = 0; i < rows; ++i) EXPECT_NE(odometer.step(drive.next({})).phase, RestPhase::moving);
  const double before = odometer.pose().heading;
  for (Increment silent : drive.over({{silence_s}})) {
    silent.has_gyro = false;
    silent.gyro_rad = 0.0;
    odometer.step(silent);
  }
  return std::abs(odometer.pose().heading - before);
}

/// What is not measured is taken to go on as before. Of a robot that stands that is the gyro's noise, at most
/// that of one row, and not the turn before the rest.
TEST(UnmeasuredRest, TheHeadingStaysWhereARobotThatStandsLosesItsGyro) {
  constexpr double kSilence_s = 6.0;
  for (const double lever_m : {0.1, 0.0})
    for (const double rate_hz : {20.0, 50.0, 100.0}) {
      double worst_rad = 0.0;
      for (int rows = 0; rows <= static_cast<int>(rate_hz); ++rows)
        worst_rad = std::max(worst_rad, heading_lost(pods_and_gyro(lever_m), rate_hz, rows, kSilence_s));
      const double noise_rad = kSilence_s * test::kGyro.noise_rad_s_sqrt_hz * std::sqrt(rate_hz);
      std::printf("lever %.1f m, %.0f Hz: at most %.5f rad, noise %.5f\n", lever_m, rate_hz, worst_rad,
                  noise_rad);
      EXPECT_LT(worst_rad, 4.0 * noise_rad) << lever_m << " " << rate_hz;
    }
}

}  // namespace
}  // namespace trundle::odometry
