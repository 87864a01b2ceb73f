// A gyro that falls silent while the robot stands: no wheel measures turning then.
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "trundle/odometry/odometer.hpp"

#include "sensed_drive.hpp"

namespace trundle::odometry {
namespace {

using test::SensedDrive;

Robot two_pods_and_gyro() {
  const std::array<Pod, 2> pods{{{0.0, 0.1, 0.0}, {-0.1, 0.0, 0.5 * kPi}}};
  return test::with_bias(
      test::robot_of(dead_wheels({.diameter_m = 0.05, .ticks_per_revolution = 2048}, pods, test::kGyro)),
      0.01);
}

/// What is integrated of a gyro that is silent goes on as before: after a rest, from standing still, at
/// whatever instant of a block the silence begins, and also before the first block is complete.
TEST(UnmeasuredRest, TheHeadingStaysWhereARobotThatStandsLosesItsGyro) {
  constexpr double kTurn_rad_s = 1.0;
  constexpr double kTurn_s = 3.0;
  constexpr double kSilence_s = 6.0;
  for (const double rate_hz : {20.0, 50.0, 100.0}) {
    const auto rows = [&](double duration_s) { return static_cast<int>(std::lround(rate_hz * duration_s)); };
    double worst_rad = 0.0, worst_sigmas = 0.0;
    for (int after = 0; after <= rows(1.0); ++after) {
      SensedDrive drive(two_pods_and_gyro(), rate_hz, 3);
      Odometer odometer = test::learning(two_pods_and_gyro());
      for (const Increment& increment : drive.over({{2.0}, {kTurn_s, 0.0, kTurn_rad_s}, {3.0}}))
        odometer.step(increment);
      for (int i = 0; i < after; ++i) odometer.step(drive.next({}));
      const double before = odometer.pose().heading;
      for (int i = 0; i < rows(kSilence_s); ++i) {
        Increment silent = drive.next({});
        silent.has_gyro = false;
        silent.gyro_rad = 0.0;
        odometer.step(silent);
      }
      const double moved_rad = std::abs(odometer.pose().heading - before);
      worst_rad = std::max(worst_rad, moved_rad);
      worst_sigmas = std::max(worst_sigmas, std::abs(odometer.pose().heading - kTurn_s * kTurn_rad_s) /
                                                std::sqrt(odometer.white()[5]));
    }
    std::printf("%.0f Hz: at most %.5f rad, %.2f sigmas from the truth\n", rate_hz, worst_rad, worst_sigmas);
    EXPECT_LT(worst_rad, 0.01) << rate_hz;
    EXPECT_LT(worst_sigmas, 4.0) << rate_hz;
  }
}

}  // namespace
}  // namespace trundle::odometry
