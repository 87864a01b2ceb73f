#include "trundle/recording/velocity_lag.hpp"

#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "trundle/recording/alignment/align.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "recording/lagging_drive.hpp"
#include "scale.hpp"

namespace trundle::recording {
namespace {

using namespace test;

/// Told to go from 0 to 1 at the first row, a motion with lag τ is 1 − exp(−t/τ): its integral is exact
/// whatever the rows are.
TEST(VelocityLag, MotionFollowsAStepExactly) {
  Robot robot = told_robot();
  robot.chassis.velocity.lag_s = 0.15;
  Recording recording;
  recording.velocity.time_s = {0.0, 0.01, 0.04, 0.1, 0.11, 0.3, 0.7};
  for (const double time_s : recording.velocity.time_s) {
    recording.velocity.forward_m_s.push_back(time_s > 0.0 ? 1.0 : 0.0);
    recording.velocity.yaw_rate_rad_s.push_back(time_s > 0.0 ? -2.0 : 0.0);
  }
  const AlignedReadings aligned = align(recording, robot);
  double way_m = 0.0, turn_rad = 0.0;
  for (const Increment& increment : aligned.increments) {
    way_m += increment.turned[0];
    turn_rad += increment.turned[1];
    const double t = increment.time_s;
    EXPECT_NEAR(way_m, t - 0.15 * (1.0 - std::exp(-t / 0.15)), 1e-12) << t;
    EXPECT_NEAR(turn_rad, -2.0 * (t - 0.15 * (1.0 - std::exp(-t / 0.15))), 1e-12) << t;
  }
  EXPECT_EQ(aligned.increments.size(), 6U);
}

/// What is left of a lag after a second goes at once, or a robot would never stand; nothing of it is lost.
TEST(VelocityLag, ARobotThatWasStoppedComesToStand) {
  Robot robot = told_robot();
  robot.chassis.velocity.lag_s = 0.15;
  Recording recording;
  double told_rad = 0.0;
  for (int i = 0; i <= 200; ++i) {
    recording.velocity.time_s.push_back(0.02 * i);
    recording.velocity.forward_m_s.push_back(i < 100 ? 0.4 : 0.0);
    recording.velocity.yaw_rate_rad_s.push_back(i > 0 && i < 100 ? 0.5 : 0.0);
    told_rad += 0.02 * recording.velocity.yaw_rate_rad_s.back();
  }
  double turned_rad = 0.0;
  for (const Increment& increment : align(recording, robot).increments) {
    turned_rad += increment.turned[1];
    if (increment.time_s > 3.1) {
      EXPECT_EQ(increment.turned[0], 0.0) << increment.time_s;
      EXPECT_EQ(increment.turned[1], 0.0) << increment.time_s;
    }
  }
  EXPECT_NEAR(turned_rad, told_rad, 1e-12);
}

TEST(VelocityLag, WithoutOneReadingsStayAsTheyAre) {
  const Recording recording = lagging_recording({.duration_s = 20.0}, 1);
  const AlignedReadings aligned = align(recording, told_robot());
  for (std::size_t i = 0; i < aligned.increments.size(); ++i) {
    const Increment& increment = aligned.increments[i];
    EXPECT_NEAR(increment.turned[0], recording.velocity.forward_m_s[i + 1] * increment.duration_s, 1e-12);
    EXPECT_NEAR(increment.turned[1], recording.velocity.yaw_rate_rad_s[i + 1] * increment.duration_s, 1e-12);
  }
  EXPECT_EQ(aligned.increments.size(), 1000U);
}

using LagBy = std::optional<TimeOffset> (*)(const Recording&, const Robot&);

double in_sigmas(const TimeOffset& found, double lag_s) {
  return (found.offset_s - lag_s) / found.sigma_s;
}

/// Commands, references and sightings at the rates that users have, and a delay besides.
std::vector<LaggingDrive> lagging_drives() {
  return {{.lag_s = 0.15, .delay_s = 0.0},
          {.lag_s = 0.1, .delay_s = 0.12, .commands_hz = 20.0, .reference_hz = 100.0},
          {.lag_s = 0.3, .delay_s = 0.05, .commands_hz = 100.0, .reference_hz = 10.0},
          {.lag_s = 0.2, .delay_s = 0.1, .turn_sigma_rad_sqrt_s = 0.02}};
}

TEST(VelocityLag, IsFoundWithinItsSigmaFromWhereverItIsSought) {
  Robot robot = told_robot();
  for (const LagBy by : {velocity_lag_by_reference, velocity_lag_by_sightings}) {
    double squares = 0.0;
    int trials = 0;
    std::uint64_t seed = 1;
    for (const LaggingDrive& how : lagging_drives())
      for (int i = 0; i < test::trials(8, 1); ++i, ++seed) {
        robot.chassis.velocity.lag_s = i % 2 == 0 ? 0.0 : 0.25;
        const auto found = by(lagging_recording(how, seed), robot);
        ASSERT_TRUE(found) << how.lag_s << ", seed " << seed;
        EXPECT_LT(std::abs(in_sigmas(*found, how.lag_s)), 4.0) << how.lag_s << ", seed " << seed;
        EXPECT_LT(found->sigma_s, 0.02);
        squares += std::pow(in_sigmas(*found, how.lag_s), 2);
        ++trials;
      }
    std::printf("squares of errors over their sigmas: %.2f of %d\n", squares / trials, trials);
    EXPECT_LT(squares, statistics::chi_squared_limit(1e-3, trials)) << trials;
  }
}

TEST(VelocityLag, IsFoundToBeNoneWhereThereIsNone) {
  for (const LagBy by : {velocity_lag_by_reference, velocity_lag_by_sightings})
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(test::trials(24, 2)); ++seed) {
      const auto found =
          by(lagging_recording({.lag_s = 0.0, .delay_s = 0.1, .duration_s = 120.0}, seed), told_robot());
      if (found) {
        EXPECT_LT(found->offset_s, 0.05) << "seed " << seed;
      }
    }
}

// Noise is less behind a lag, which fits better for that: 0.16 s of a robot without one.
TEST(VelocityLag, IsNotSoughtOfAVelocityThatWasMeasured) {
  Recording recording = lagging_recording({.lag_s = 0.0, .duration_s = 120.0}, 1);
  statistics::Random random(2);
  for (double& rate : recording.velocity.yaw_rate_rad_s) rate += random.normal(0.1);
  EXPECT_FALSE(velocity_lag_by_reference(recording, told_robot()));
  EXPECT_FALSE(velocity_lag_by_sightings(recording, told_robot()));
}

TEST(VelocityLag, OfASecondsDriveThereIsNoneOrALargeSigma) {
  for (const double duration_s : {0.05, 1.0, 3.0, 8.0})
    for (const LagBy by : {velocity_lag_by_reference, velocity_lag_by_sightings})
      if (const auto found =
              by(lagging_recording({.lag_s = 0.2, .duration_s = duration_s}, 4), told_robot())) {
        EXPECT_LT(std::abs(in_sigmas(*found, 0.2)), 4.0) << duration_s;
      }
}

// No lag is sought beyond a second: that of the robot file stays.
TEST(VelocityLag, ALongOneIsNotJudged) {
  Robot robot = told_robot();
  robot.chassis.velocity.lag_s = 1.5;
  EXPECT_FALSE(velocity_lag_by_reference(lagging_recording({.lag_s = 1.5}, 3), robot));
}

}  // namespace
}  // namespace trundle::recording
