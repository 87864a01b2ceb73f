#include "trundle/simulation/drive.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "trundle/chassis/rows.hpp"
#include "trundle/chassis/scrub.hpp"
#include "trundle/chassis/tyre_growth.hpp"
#include "trundle/io/error.hpp"

#include "robots.hpp"

namespace trundle::simulation {
namespace {

using test::exact_scenario;
using test::quiet_differential;

Robot quiet(const Chassis& chassis) {
  Robot robot;
  robot.chassis = chassis;
  robot.chassis.noise = {0.0, 0.0, 0.0, 0.0, 0.0};
  for (int i = 0; i < chassis.wheel_count; ++i) robot.wheel_names.push_back(fmt::format("w{}", i));
  return robot;
}

constexpr WheelSize kSize{.diameter_m = 0.1, .ticks_per_revolution = 1000.0};

Robot velocity_robot(const VelocityCorrection& velocity) {
  Robot robot = quiet({});
  robot.chassis.velocity = velocity;
  return robot;
}
constexpr VelocityCorrection kCorrection{
    .forward_scale = 1.04, .yaw_scale = 0.93, .yaw_per_forward_rad_m = 0.03, .yaw_bias_rad_s = -0.004};

/// The increment between two moments, as exact sensors read it.
Increment increment_between(const Moment& before, const Moment& after) {
  Increment increment{after.time_s, after.time_s - before.time_s};
  for (std::size_t i = 0; i < increment.turned.size(); ++i)
    increment.turned[i] = after.turned[i] - before.turned[i];
  increment.gyro_rad = after.body.heading - before.body.heading;
  increment.has_gyro = true;
  return increment;
}

/// Plain odometry of the wheels' revolutions.
Pose2 dead_reckoned(const Drive& drive, const Chassis& chassis) {
  const Rows rows = rows_of(chassis, chassis.gyro.has_value());
  const ScrubGauge gauge(chassis);
  Pose2 pose = drive.moments.front().body;
  for (std::size_t i = 1; i < drive.moments.size(); ++i) {
    Increment increment = increment_between(drive.moments[i - 1], drive.moments[i]);
    ScrubState afresh;  // the simulation knows how sharp each turn is, and how fast
    if (gauge.applies()) gauge.add(afresh, increment);
    SpeedState speed_afresh;
    SpeedGauge(chassis).add(speed_afresh, increment);
    pose = pose * exp(estimate_twist(rows, readings_of(chassis, rows, increment)).twist);
  }
  return pose;
}

struct NamedChassis {
  const char* name;
  Chassis chassis;
  bool sideways;
};

Chassis pods() {
  const std::array<Pod, 2> places = {Pod{0.02, 0.1, 0.5 * kPi - 0.03}, Pod{-0.05, 0.0, 0.0}};
  return dead_wheels(kSize, places, Gyro{});
}

Chassis with_icr(Chassis chassis, double icr_x_m) {
  chassis.icr_x_m = icr_x_m;
  return chassis;
}

Chassis with_scrub_of(double scrub, Chassis chassis) {
  chassis.scrub = scrub;
  return chassis;
}

Chassis with_growth_of(double tyre_growth_s2_m2, Chassis chassis) {
  chassis.tyre_growth_s2_m2 = tyre_growth_s2_m2;
  return chassis;
}

class EveryChassis : public testing::TestWithParam<NamedChassis> {
 protected:
  Scenario scenario(Steering steering) const {
    Random random(9);
    const Tour tour{.length_m = 15.0, .sideways = GetParam().sideways};
    const Robot robot = quiet(GetParam().chassis);
    Scenario scenario = exact_scenario(robot, robot, random_tour(tour, {}, random));
    scenario.steering = steering;
    return scenario;
  }
};

TEST_P(EveryChassis, OdometryOfThePerfectRobotEndsAtTheTruth) {
  for (const Steering steering : {Steering::odometry, Steering::truth}) {
    const Drive driven = drive(scenario(steering));
    const Pose2 odometry = dead_reckoned(driven, GetParam().chassis);
    const Pose2 truth = driven.moments.back().body;
    EXPECT_NEAR(odometry.x, truth.x, 1e-9);
    EXPECT_NEAR(odometry.y, truth.y, 1e-9);
    EXPECT_NEAR(odometry.heading, truth.heading, 1e-9);
  }
}

TEST_P(EveryChassis, SteeringByOdometryFollowsThePathInTheEyesOfTheNominalRobot) {
  Scenario s = scenario(Steering::odometry);
  for (Wheel& wheel : s.truth.chassis.wheels()) wheel.diameter_m *= 1.02;
  s.truth.chassis.wheels()[0].diameter_m *= 1.01;
  const Drive driven = drive(s);
  const Drive ideal = drive(scenario(Steering::odometry));
  EXPECT_GT((driven.moments.back().body.translation() - ideal.moments.back().body.translation()).norm(),
            0.01);
  const Chassis& chassis = GetParam().chassis;
  if (chassis.gyro) return;  // its heading comes from a gyro that was not counted here
  const Pose2 believed = dead_reckoned(driven, chassis);
  EXPECT_NEAR(believed.x, ideal.moments.back().body.x, 1e-9);
  EXPECT_NEAR(believed.y, ideal.moments.back().body.y, 1e-9);
  EXPECT_NEAR(believed.heading, ideal.moments.back().body.heading, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(
    Chassis, EveryChassis,
    testing::Values(NamedChassis{"differential", differential_drive(kSize, 0.3), false},
                    NamedChassis{"skid_steer", skid_steer(kSize, 0.6, 0.4), false},
                    NamedChassis{"skid_steer_icr", with_icr(skid_steer(kSize, 0.6, 0.4), 0.05), false},
                    NamedChassis{"skid_steer_scrub", with_scrub_of(0.15, skid_steer(kSize, 0.6, 0.4)), false},
                    NamedChassis{"omni3", omni3(kSize, 0.2), true},
                    NamedChassis{"mecanum", mecanum(kSize, 0.4, 0.3), true},
                    NamedChassis{"pods", pods(), true},
                    NamedChassis{"differential_growing", with_growth_of(0.5, differential_drive(kSize, 0.3)),
                                 false},
                    NamedChassis{"mecanum_shrinking", with_growth_of(-0.5, mecanum(kSize, 0.4, 0.3)), true}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Drive, AVelocityIsReadSoThatItsCorrectionEndsAtTheTruth) {
  const Robot truth = velocity_robot(kCorrection), nominal = velocity_robot({});
  Random random(9);
  Scenario s = exact_scenario(nominal, truth, random_tour({.length_m = 15.0}, {}, random));
  for (const Steering steering : {Steering::odometry, Steering::truth}) {
    s.steering = steering;
    const Drive driven = drive(s);
    const Pose2 odometry = dead_reckoned(driven, truth.chassis);
    const Pose2 end = driven.moments.back().body;
    EXPECT_NEAR(odometry.x, end.x, 1e-9);
    EXPECT_NEAR(odometry.y, end.y, 1e-9);
    EXPECT_NEAR(odometry.heading, end.heading, 1e-9);
    const Pose2 believed = dead_reckoned(driven, nominal.chassis);
    EXPECT_GT((believed.translation() - end.translation()).norm(), 0.1);
    if (steering == Steering::truth) continue;
    s.truth = nominal;
    const Pose2 asked = drive(s).moments.back().body;
    s.truth = truth;
    EXPECT_NEAR(believed.x, asked.x, 1e-9);
    EXPECT_NEAR(believed.y, asked.y, 1e-9);
    EXPECT_NEAR(believed.heading, asked.heading, 1e-9);
  }
}

TEST(Drive, PodsOfAnLRunEndWhereTheInstallationAngleSays) {
  // docs/theory/simulation.md: the robot ends at (S, S (1 − sin α)/cos α).
  constexpr double S = 2.0;
  constexpr double alpha = 0.05;
  const auto robot = [](double error) {
    const std::array<Pod, 2> places = {Pod{0.0, 0.0, 0.5 * kPi - error}, Pod{0.0, 0.0, 0.0}};
    return quiet(dead_wheels(kSize, places, Gyro{}));
  };
  const Pose2 end = drive(exact_scenario(robot(0.0), robot(alpha), l_run(S))).moments.back().body;
  EXPECT_NEAR(end.x, S, 1e-12);
  EXPECT_NEAR(end.y, S * (1.0 - std::sin(alpha)) / std::cos(alpha), 1e-12);
  EXPECT_NEAR(end.heading, 0.0, 1e-12);
}

TEST(Drive, RobotThatCannotSteerByItsWheelsIsRefused) {
  const std::array<Pod, 2> places = {Pod{0.0, 0.0, 0.5 * kPi}, Pod{}};
  Chassis chassis = dead_wheels(kSize, places, Gyro{});
  chassis.gyro.reset();
  Scenario scenario = exact_scenario(quiet(chassis), quiet(chassis), l_run(1.0));
  EXPECT_THROW(drive(scenario), CannotAnswer);
  scenario.steering = Steering::truth;
  EXPECT_NEAR(drive(scenario).moments.back().body.y, 1.0, 1e-12);
}

TEST(Drive, WheelNoiseTurnsTheRobotAsItsModelSays) {
  // A straight run of L: heading variance 2 k² L/b². The estimate of a variance from n runs has sigma √(2/(n
  // − 1)).
  constexpr double k = 0.01, L = 4.0, b = 0.5;
  constexpr int n = 1000;
  Robot truth = quiet_differential();
  truth.chassis.noise.wheel_per_sqrt_m = k;
  Scenario scenario = exact_scenario(quiet_differential(), truth, straight(L));
  scenario.encoders.rate_hz = 5.0;
  double sum2 = 0.0;
  for (int i = 0; i < n; ++i) {
    scenario.seed = static_cast<std::uint64_t>(i);
    sum2 += std::pow(drive(scenario).moments.back().body.heading, 2);
  }
  EXPECT_NEAR(sum2 / n / (2.0 * k * k * L / (b * b)), 1.0, 4.0 * std::sqrt(2.0 / (n - 1)));
}

TEST(Drive, ResidualsOfARedundantChassisAreChiSquared) {
  // Four wheels, three unknowns: one degree of freedom, whichever robot steers.
  Robot robot = quiet(mecanum(kSize, 0.4, 0.3));
  robot.chassis.noise.wheel_per_sqrt_m = 0.01;
  for (Wheel& wheel : robot.chassis.wheels())
    wheel.ticks_per_revolution = 0.0;  // no quantisation in the model
  const Rows rows = rows_of(robot.chassis, false);
  for (const Steering steering : {Steering::odometry, Steering::truth}) {
    Scenario scenario = exact_scenario(robot, robot, straight(400.0));
    scenario.steering = steering;
    scenario.encoders.rate_hz = 1.0;
    const Drive driven = drive(scenario);
    double sum = 0.0;
    const auto n = static_cast<double>(driven.moments.size() - 1);
    for (std::size_t i = 1; i < driven.moments.size(); ++i)
      sum += residual_test(rows, readings_of(robot.chassis, rows,
                                             increment_between(driven.moments[i - 1], driven.moments[i])))
                 .chi2;
    // The variance is taken from the noisy travel: a bias of order k²/travel, far below the limit.
    EXPECT_NEAR(sum / n, 1.0, 4.0 * std::sqrt(2.0 / n));
  }
}

TEST(Drive, LateralNoiseMovesTheRobotSideways) {
  constexpr double per_sqrt_m = 0.02, L = 9.0;
  constexpr int n = 1000;
  Robot truth = quiet_differential();
  truth.chassis.noise.lateral_per_sqrt_m = per_sqrt_m;
  double sum2 = 0.0;
  for (int i = 0; i < n; ++i) {
    Scenario scenario = exact_scenario(quiet_differential(), truth, straight(L));
    scenario.encoders.rate_hz = 1.0;
    scenario.seed = static_cast<std::uint64_t>(i);
    const Pose2 end = drive(scenario).moments.back().body;
    EXPECT_NEAR(end.x, L, 1e-9);
    sum2 += end.y * end.y;
  }
  EXPECT_NEAR(sum2 / n / (per_sqrt_m * per_sqrt_m * L), 1.0, 4.0 * std::sqrt(2.0 / (n - 1)));
}

class Slip : public testing::TestWithParam<Steering> {};

TEST_P(Slip, ExcessIsWhatTheWheelTurnedTooMuch) {
  Scenario scenario = exact_scenario(quiet_differential(), quiet_differential(), straight(4.0));
  scenario.steering = GetParam();
  scenario.slips = {{.wheel = 1, .span = {3.03, 1.01}, .factor = 1.5}};  // off the sampling grid
  const Drive driven = drive(scenario);
  ASSERT_EQ(driven.slips.size(), 1u);
  const SlipTruth& slip = driven.slips.front();
  // 0.2 m/s for 1.01 s: of the ground when the truth drives the path, of the wheel when the odometry does.
  const double expected = GetParam() == Steering::truth ? 0.5 * 0.202 : 0.202 / 3.0;
  EXPECT_NEAR(slip.excess_m, expected, 1e-12);
  EXPECT_NEAR(slip.ground_m * 1.5, slip.ground_m + slip.excess_m, 1e-12);
  EXPECT_TRUE(slip.spins());
  const Pose2 error = driven.moments.back().body.inverse() * dead_reckoned(driven, scenario.nominal.chassis);
  EXPECT_NEAR(error.heading, slip.excess_m / 0.5, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Steering, Slip, testing::Values(Steering::odometry, Steering::truth));

TEST(Slip, ALockedWheelSkids) {
  Scenario scenario = exact_scenario(quiet_differential(), quiet_differential(), straight(2.0));
  scenario.steering = Steering::truth;
  scenario.slips = {{.wheel = 0, .span = {1.0, 2.0}, .factor = 0.0}};
  const Drive driven = drive(scenario);
  EXPECT_NEAR(driven.slips.front().excess_m, -0.4, 1e-12);
  EXPECT_FALSE(driven.slips.front().spins());
  EXPECT_NEAR(driven.moments.back().turned[0] * kPi * 0.15, 1.6, 1e-12);
}

TEST(Slip, RandomBurstsDoNotOverlap) {
  Scenario scenario = exact_scenario(quiet_differential(), quiet_differential(), straight(10.0));
  scenario.random_slips = {.count = 12};
  const Drive driven = drive(scenario);
  ASSERT_EQ(driven.slips.size(), 12u);
  for (std::size_t i = 0; i < driven.slips.size(); ++i) {
    EXPECT_GT(driven.slips[i].excess_m, 0.0);
    for (std::size_t j = 0; j < i; ++j) {
      const TimeSpan& a = driven.slips[i].span;
      const TimeSpan& b = driven.slips[j].span;
      EXPECT_TRUE(a.end_s() <= b.start_s || b.end_s() <= a.start_s);
    }
  }
}

}  // namespace
}  // namespace trundle::simulation
