// By how much readings contradict each other is what the sensors err by, whatever a reference makes of their
// noise.
#include "trundle/calibration/solve/contradicting_share.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/calibration/preparation/preparation.hpp"

#include "calibration/gyro_bias_oracle.hpp"

namespace trundle::calibration {
namespace {

using namespace test::drifting_gyro;

constexpr double kWindow_s = 1.0;
// Four drives of a minute are 240 windows in 68 blocks, of one number each: the median of their χ² is known
// to 11 % (√(π/2) √(2/240)).
constexpr double kThreeSigma = 0.33;

/// Of wheels that err as they do in the simulation, beside a gyro that hardly does.
class ContradictingShareTest : public testing::Test {
 protected:
  std::optional<ContradictingShare> share_of(const Machine& machine, double times_as_noisy,
                                             double times_as_noisy_a_gyro = 1.0) {
    std::vector<calibration::Run> runs =
        prepare_runs(driven(machine, conditions_, 3).recordings, machine.truth);
    for (calibration::Run& run : runs)
      for (std::size_t i = gap_every_; i > 0 && i < run.readings.bridged.size(); i += gap_every_)
        run.readings.bridged[i] = true;
    Likelihood likelihood = likelihood_of({runs, machine.truth, {}});
    NoiseLevels levels = noise_levels_of(machine.truth);
    levels.wheel_per_sqrt_m = times_as_noisy * kWheelNoise;
    levels.gyro_rad_s_sqrt_hz = times_as_noisy_a_gyro * conditions_.gyro_noise;
    likelihood.noise = {levels, true};
    return contradicting_share(likelihood, machine.truth, kWindow_s);
  }

  Conditions conditions_{.rate_hz = 50.0};
  std::size_t gap_every_ = 0;  ///< increments; 0: there is none
  Machine machine_ = with_good_gyro(differential_machine(), conditions_);
};

TEST_F(ContradictingShareTest, IsWhatWheelsErrByApart) {
  for (const double times : {2.0, 5.0, 20.0}) {
    const auto found = share_of(machine_, times);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->share * times * times, 1.0, kThreeSigma) << times;
    EXPECT_EQ(found->factor, 1.0);
  }
}

TEST_F(ContradictingShareTest, WhatIsMoreThanAllIsAFactor) {
  const auto found = share_of(machine_, 0.25);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->share, 1.0);
  EXPECT_NEAR(found->factor / 16.0, 1.0, kThreeSigma);
}

/// Most of the time it stands: the median of all windows would be nothing.
TEST_F(ContradictingShareTest, RestsShowNothing) {
  conditions_.duration_s = 8.0;
  conditions_.runs = 30;
  const auto found = share_of(machine_, 5.0);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->share * 25.0, 1.0, kThreeSigma);
}

TEST_F(ContradictingShareTest, WindowsThatAGapEndsCount) {
  gap_every_ = 40;  // 0.8 s: no window is whole
  const auto found = share_of(machine_, 5.0);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->share * 25.0, 1.0, kThreeSigma);
}

/// A gyro's noise by the reference is that of what else turns a heading, too.
TEST_F(ContradictingShareTest, IsOneOfWheelsAndGyroTogether) {
  const double gyro_times = 100.0 * kWheelNoise / conditions_.gyro_noise;
  const auto by_both = share_of(machine_, 3.0, gyro_times), by_wheels = share_of(machine_, 3.0);
  ASSERT_TRUE(by_both && by_wheels);
  EXPECT_LT(by_both->share, 0.1 * by_wheels->share);
}

TEST_F(ContradictingShareTest, ThereIsNoneWhereNothingContradicts) {
  EXPECT_FALSE(share_of(pods_machine(), 1.0));
  conditions_ = {.rate_hz = 50.0, .duration_s = 5.0, .rests = false, .runs = 1};
  EXPECT_FALSE(share_of(machine_, 1.0));  // five windows
}

TEST(ContradictingRobot, HasTheGyrosOwnNoiseAndAShareOfWhatIsBeyond) {
  const Robot robot = differential_machine().truth;
  std::vector<calibration::Run> runs;
  Likelihood likelihood = likelihood_of({runs, robot, {}});
  likelihood.noise.levels.wheel_per_sqrt_m = 0.01;
  likelihood.noise.levels.gyro_rad_s_sqrt_hz = 5.0 * kGyroNoise;
  const Chassis quarter = contradicting_robot(robot, likelihood, 0.25).chassis;
  EXPECT_NEAR(wheel_noise(quarter, 0), 0.005, 1e-15);
  EXPECT_NEAR(quarter.gyro->noise_rad_s_sqrt_hz, std::sqrt(7.0) * kGyroNoise, 1e-15);  // 1 + ¼ (25 − 1)
  EXPECT_EQ(contradicting_robot(robot, likelihood, 1.0).chassis.gyro->noise_rad_s_sqrt_hz, 5.0 * kGyroNoise);
}

}  // namespace
}  // namespace trundle::calibration
