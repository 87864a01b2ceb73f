#include "trundle/recording/velocity_lag.hpp"

#include <cmath>

#include <boost/math/distributions/binomial.hpp>
#include <gtest/gtest.h>

#include "trundle/recording/alignment/align.hpp"
#include "trundle/statistics/distribution.hpp"

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

TEST(VelocityLag, WithoutOneReadingsStayAsTheyAre) {
  const Recording recording = lagging_recording({.duration_s = 20.0}, 1);
  const AlignedReadings aligned = align(recording, told_robot());
  for (std::size_t i = 0; i < aligned.increments.size(); ++i) {
    const Increment& increment = aligned.increments[i];
    EXPECT_NEAR(increment.turned[0], recording.velocity.forward_m_s[i + 1] * increment.duration_s, 1e-12);
  }
}

using LagBy = std::optional<TimeOffset> (*)(const Recording&, const Robot&);

/// Commands, references and sightings at the rates that users have, and a delay besides.
std::vector<LaggingDrive> lagging_drives() {
  return {{.lag_s = 0.15, .delay_s = 0.0},
          {.lag_s = 0.1, .delay_s = 0.12, .commands_hz = 20.0, .reference_hz = 100.0},
          {.lag_s = 0.3, .delay_s = 0.05, .commands_hz = 100.0, .reference_hz = 10.0},
          {.lag_s = 0.2, .delay_s = 0.1, .turn_sigma_rad_sqrt_s = 0.02}};
}

TEST(VelocityLag, IsFoundWithinItsSigma) {
  for (const LagBy by : {velocity_lag_by_reference, velocity_lag_by_sightings}) {
    double squares = 0.0;
    int trials = 0;
    std::uint64_t seed = 1;
    for (const LaggingDrive& how : lagging_drives())
      for (int i = 0; i < test::trials(8, 1); ++i, ++seed) {
        const auto lag = by(lagging_recording(how, seed), told_robot());
        ASSERT_TRUE(lag) << how.lag_s << ", seed " << seed;
        EXPECT_NEAR(lag->offset_s, how.lag_s, 4.0 * lag->sigma_s) << "seed " << seed;
        EXPECT_LT(lag->sigma_s, 0.04);
        squares += std::pow((lag->offset_s - how.lag_s) / lag->sigma_s, 2);
        ++trials;
      }
    EXPECT_LT(squares, statistics::chi_squared_limit(1e-3, trials)) << trials;
  }
}

TEST(VelocityLag, IsNotFoundWhereThereIsNone) {
  const int trials = test::trials(24, 2);
  int found = 0;
  for (const LagBy by : {velocity_lag_by_reference, velocity_lag_by_sightings})
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(trials); ++seed)
      if (const auto lag =
              by(lagging_recording({.lag_s = 0.0, .delay_s = 0.1, .duration_s = 120.0}, seed), told_robot());
          lag && is_off(*lag, 0.0)) {
        ++found;
        EXPECT_LT(lag->offset_s, 0.04);
      }
  // Two sigmas, one-sided: once in 44; more than that with a chance of less than 1 in 1000.
  const boost::math::binomial by_chance(2 * trials, 0.0228);
  EXPECT_LE(found, boost::math::quantile(boost::math::complement(by_chance, 1e-3)));
}

TEST(VelocityLag, IsNotFoundInASecondsDrive) {
  for (const double duration_s : {0.05, 1.0, 3.0, 8.0})
    for (const LagBy by : {velocity_lag_by_reference, velocity_lag_by_sightings})
      if (const auto lag = by(lagging_recording({.lag_s = 0.2, .duration_s = duration_s}, 4), told_robot())) {
        EXPECT_GE(duration_s, 8.0);
        EXPECT_NEAR(lag->offset_s, 0.2, 4.0 * lag->sigma_s);
      }
}

TEST(VelocityLag, IsThatOfTheRobotFileWhereItIsRight) {
  Robot robot = told_robot();
  robot.chassis.velocity.lag_s = 0.2;
  const auto lag = velocity_lag_by_reference(lagging_recording({.lag_s = 0.2, .delay_s = 0.1}, 3), robot);
  EXPECT_FALSE(lag && is_off(*lag, 0.2));
}

}  // namespace
}  // namespace trundle::recording
