#include "trundle/odometry/rest.hpp"

#include <cstring>

#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "scale.hpp"
#include "sensed_drive.hpp"

namespace trundle::odometry {
namespace {

using test::learning;
using test::Piece;
using test::robot_with_gyro;
using test::SensedDrive;
using test::with_bias;

constexpr double kDegree = kPi / 180.0;

/// Steps through everything and returns the last verdict.
Verdict run(Odometer& odometer, const std::vector<Increment>& increments) {
  Verdict verdict;
  for (const Increment& increment : increments) verdict = odometer.step(increment);
  return verdict;
}

TEST(Rest, StandingStillIsSeenAfterABlockAndEndsWithTheFirstStep) {
  for (const double rate_hz : {4.0, 20.0, 100.0}) {
    SensedDrive drive(with_bias(robot_with_gyro(), 0.02), rate_hz, 1);
    Odometer odometer = learning(robot_with_gyro());
    double rest_s = 0.0;
    for (const Increment& increment : drive.over({{10.0}}))
      rest_s += odometer.step(increment).at_rest() ? increment.duration_s : 0.0;
    EXPECT_GE(rest_s, 9.0) << rate_hz;
    EXPECT_EQ(run(odometer, drive.over({{1.0, 0.2, 0.1}})).phase, RestPhase::moving);
    EXPECT_TRUE(run(odometer, drive.over({{1.5}})).at_rest());
  }
}

TEST(Rest, CountersMayToggleButNotCreep) {
  const Robot robot = robot_with_gyro();
  SensedDrive drive(robot, 20.0, 2);
  Odometer toggles = learning(robot);
  Odometer creeps = learning(robot);
  double rest_s = 0.0;
  double creep_s = 0.0;
  const double tick = 1.0 / 1024.0;
  const std::vector<Increment> still = drive.over({{20.0}});
  for (std::size_t i = 0; i < still.size(); ++i) {
    Increment increment = still[i];
    increment.turned[0] = i % 2 == 0 ? tick : -tick;
    rest_s += toggles.step(increment).at_rest() ? 0.05 : 0.0;
    increment.turned[0] = increment.turned[1] = i % 4 == 0 ? tick : 0.0;
    creep_s += creeps.step(increment).at_rest() ? 0.05 : 0.0;
  }
  EXPECT_GT(rest_s, 19.0);
  EXPECT_EQ(creep_s, 0.0);
  EXPECT_NEAR(toggles.pose().x, 0.0, 1e-3);
  EXPECT_NEAR(creeps.pose().x, 100 * tick * kPi * 0.15, 1e-3);  // no count is lost
}

/// What the wheels turn while they come to stand is withheld until the rest is sure, and then counted once.
TEST(Rest, TheLastCountsBeforeItAreNotLost) {
  const double tick = 1.0 / 1024.0;
  const double travel_m = tick * kPi * 0.15;
  SensedDrive drive(robot_with_gyro(), 20.0, 2);
  Odometer odometer = learning(robot_with_gyro());
  std::vector<Increment> still = drive.over({{2.0}});
  still[0].turned[0] = still[0].turned[1] = tick;
  for (std::size_t i = 0; i < 9; ++i) odometer.step(still[i]);
  EXPECT_EQ(odometer.pose().x, 0.0);
  for (std::size_t i = 9; i < still.size(); ++i) odometer.step(still[i]);
  EXPECT_NEAR(odometer.pose().x, travel_m, 1e-12);
  EXPECT_NEAR(odometer.pose().heading, 0.0, 1e-12);
  Increment push = still.back();
  push.turned[0] = push.turned[1] = 10.0 * tick;
  EXPECT_EQ(odometer.step(push).phase, RestPhase::moving);
  EXPECT_NEAR(odometer.pose().x, 11.0 * travel_m, 1e-3 * travel_m);
}

TEST(Rest, TheHeadingDoesNotMove) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.02), 20.0, 3);
  Odometer odometer = learning(robot_with_gyro());
  double largest = 0.0;
  for (int i = 0; i < 20 * 600; ++i) {
    odometer.step(drive.next({}));
    largest = std::max(largest, std::abs(odometer.pose().heading));
  }
  RecordProperty("largest_deg", std::to_string(largest / kDegree));
  EXPECT_LT(largest, 0.05 * kDegree);  // over ten minutes
}

TEST(Rest, TheBiasIsAsGoodAsAKalmanFilterThatKnowsOfTheRest) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.02), 20.0, 4);
  Odometer odometer = learning(robot_with_gyro());
  run(odometer, drive.over({{10.0}}));
  const double optimum = 3e-4 / std::sqrt(10.0);
  EXPECT_NEAR(optimum / kDegree * 60.0, 0.33, 0.005);  // °/min
  RecordProperty("ratio", std::to_string(std::sqrt(odometer.gyro_bias().variance) / optimum));
  EXPECT_LT(std::sqrt(odometer.gyro_bias().variance), 1.2 * optimum);
  EXPECT_GT(std::sqrt(odometer.gyro_bias().variance), optimum);
}

/// A drive that does not rest before its first stop, in which the robot still turns behind its last count.
struct Stop {
  double ticks_per_revolution;
  double forward_m_s;
  double turn_rad_s;
  double stops_within_s;
};

/// Error of the bias and of the heading after 6 s of rest, in sigmas.
Vector2 errors_after(const Stop& stop, std::uint64_t seed) {
  const double rate_hz = 50.0;
  Random random(seed, 5);
  Robot robot = test::robot_of(
      differential_drive({.diameter_m = 0.1, .ticks_per_revolution = stop.ticks_per_revolution}, 0.3));
  robot.chassis.gyro = test::kGyro;
  robot.chassis.gyro->bias_sigma_rad_s = 0.003;
  SensedDrive drive(with_bias(robot, random.normal(0.003)), rate_hz, seed);
  // the stop begins anywhere between two counts
  std::vector<Piece> pieces = {{10.0 + random.uniform(0.0, 1.0) * 0.157 / stop.forward_m_s, stop.forward_m_s},
                               {4.0, stop.forward_m_s, stop.turn_rad_s}};
  for (double left_s = stop.stops_within_s - 0.5 / rate_hz; left_s > 0.0; left_s -= 1.0 / rate_hz) {
    const double share = left_s / stop.stops_within_s;
    pieces.push_back({1.0 / rate_hz, share * stop.forward_m_s, share * stop.turn_rad_s});
  }
  pieces.push_back({6.0});
  Odometer odometer = learning(robot);
  EXPECT_TRUE(run(odometer, drive.over(pieces)).at_rest());
  const double turned = stop.turn_rad_s * (4.0 + 0.5 * stop.stops_within_s);
  const GyroBias bias = odometer.gyro_bias();
  EXPECT_LT(std::sqrt(bias.variance), 6e-4);  // of one block alone 4.2e-4
  return {(bias.rad_s - drive.bias_rad_s()) / std::sqrt(bias.variance),
          (odometer.pose().heading - turned) / std::sqrt(odometer.white()[5])};
}

/// docs/theory/gyro.md, eq. 3a: what the robot turns behind its last count is no bias.
TEST(Rest, TheBiasIsNotLearnedFromTheEndOfATurn) {
  const int seeds = test::trials(200, 40);
  const Stop stops[] = {{20.0, 0.1, 0.05, 2.0},   {20.0, 0.2, 0.1, 1.0},    {100.0, 0.1, 0.05, 2.0},
                        {100.0, 0.1, -0.05, 2.0}, {360.0, 0.03, 0.05, 1.0}, {1024.0, 0.2, 0.5, 0.5}};
  for (const Stop& stop : stops) {
    Vector2 sum = Vector2::Zero();
    Vector2 squares = Vector2::Zero();
    for (int seed = 0; seed < seeds; ++seed) {
      const Vector2 z = errors_after(stop, static_cast<std::uint64_t>(seed));
      sum += z;
      squares += z.cwiseAbs2();
    }
    // 99.9 % of the means of z, and of z² on its upper side, whose variances are 1 and 2
    const Vector2 mean = sum / seeds;
    const Vector2 square = squares / seeds;
    RecordProperty("mean_" + std::to_string(stop.ticks_per_revolution), std::to_string(mean.x()));
    EXPECT_LT(mean.cwiseAbs().maxCoeff(), 3.29 / std::sqrt(seeds))
        << stop.ticks_per_revolution << " " << mean;
    EXPECT_LT(square.maxCoeff(), 1.0 + 3.09 * std::sqrt(2.0 / seeds)) << stop.ticks_per_revolution;
  }
}

TEST(Rest, ARobotThatCreepsAnyCountOfItsWheelsIsNotAtRest) {
  const double tick = 1.0 / 1024.0;
  for (const double count_s : {0.2, 0.7, 1.5, 3.0}) {
    SensedDrive drive(robot_with_gyro(), 20.0, 2);
    Odometer odometer = learning(robot_with_gyro());
    const int every = static_cast<int>(std::lround(20.0 * count_s));
    for (int i = 0; i < 20 * 20; ++i) {
      Increment increment = drive.next({});
      increment.turned[0] = increment.turned[1] = i % every == 0 ? tick : 0.0;
      const Verdict verdict = odometer.step(increment);
      EXPECT_TRUE(i <= every || !verdict.at_rest()) << count_s << " " << i;
    }
  }
}

/// Share of seeds whose bias lies inside its 95 % interval.
double coverage(int seeds, double rest_s, const std::vector<Piece>& then) {
  int inside = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), 3);
    SensedDrive drive(with_bias(robot_with_gyro(), random.normal(0.02)), 20.0,
                      static_cast<std::uint64_t>(seed));
    Odometer odometer = learning(robot_with_gyro());
    run(odometer, drive.over({{rest_s}}));
    run(odometer, drive.over(then));
    const GyroBias bias = odometer.gyro_bias();
    inside += std::abs(bias.rad_s - drive.bias_rad_s()) <= 1.959964 * std::sqrt(bias.variance) ? 1 : 0;
  }
  return static_cast<double>(inside) / seeds;
}

TEST(Rest, TheBiasLiesInsideItsInterval) {
  const int seeds = test::trials(1000, 100);
  const double band = 0.02 * std::sqrt(1000.0 / seeds);  // 2.9 sigma of the share
  const double share = coverage(seeds, 10.0, {});
  RecordProperty("share", std::to_string(share));
  EXPECT_NEAR(share, 0.95, band);
  EXPECT_NEAR(coverage(seeds, 3.0, {{5.0, 0.3, 0.4}, {2.0}, {5.0, -0.3, 0.4}, {3.0}, {1.0, 0.2}}), 0.95,
              band);
}

TEST(Rest, ARunThatStartsMovingLearnsNoBias) {
  const std::vector<Piece> starts[] = {{{20.0, 0.25, 0.0}},  {{20.0, 0.0, 0.04}}, {{20.0, -0.1, -0.3}},
                                       {{20.0, 0.01, 0.01}}, {{20.0, 0.0, 0.01}}, {{20.0, 0.25, 1.0}}};
  for (const auto& pieces : starts)
    for (const double rate_hz : {4.0, 20.0, 100.0}) {
      SensedDrive drive(with_bias(robot_with_gyro(), 0.01), rate_hz, 5);
      Odometer odometer = test::learning_by_rests_alone(robot_with_gyro());
      for (const Increment& increment : drive.over(pieces))
        ASSERT_FALSE(odometer.step(increment).at_rest()) << rate_hz << " " << pieces[0].turn_rad_s;
      EXPECT_EQ(odometer.gyro_bias().rad_s, 0.0);
      EXPECT_GE(odometer.gyro_bias().variance, 0.02 * 0.02);
    }
}

/// Drives a robot some of whose encoders are dead, after `rest_s` of standing still. Returns how long the
/// first of them stays unnoticed.
double unnoticed_s(const std::vector<std::size_t>& dead, const Piece& motion, double rest_s, double rate_hz,
                   const Robot& robot = robot_with_gyro()) {
  SensedDrive drive(with_bias(robot, 0.01), rate_hz, 6);
  for (const std::size_t wheel : dead) drive.encoder_gain[wheel] = 0.0;
  Odometer odometer = learning(robot);
  for (const Increment& increment : drive.over({{rest_s}})) EXPECT_EQ(odometer.step(increment).stuck, 0U);
  double time_s = 0.0;
  for (const Increment& increment : drive.over({motion})) {
    time_s += increment.duration_s;
    const Verdict verdict = odometer.step(increment);
    EXPECT_FALSE(verdict.at_rest());
    bool all = true;
    for (const std::size_t wheel : dead) all = all && verdict.is_stuck(wheel);
    if (all) return time_s;
  }
  return 1e9;
}

TEST(Rest, ADeadEncoderIsNoticedWithinHalfASecond) {
  for (const double rate_hz : {4.0, 20.0, 100.0})
    for (const double rest_s : {0.0, 5.0}) {
      EXPECT_LE(unnoticed_s({0}, {3.0, 0.25, 0.0}, rest_s, rate_hz), 0.5) << rate_hz << " " << rest_s;
      EXPECT_LE(unnoticed_s({1}, {3.0, 0.25, 0.0}, rest_s, rate_hz), 0.5) << rate_hz << " " << rest_s;
      EXPECT_LE(unnoticed_s({0}, {3.0, -0.1, 0.2}, rest_s, rate_hz), 0.5) << rate_hz << " " << rest_s;
      EXPECT_LE(unnoticed_s({1}, {3.0, 0.0, 0.5}, rest_s, rate_hz), 0.5) << rate_hz << " " << rest_s;
      EXPECT_LE(unnoticed_s({0, 1}, {3.0, 0.25, 0.3}, rest_s, rate_hz), 0.5) << rate_hz << " " << rest_s;
      EXPECT_LE(unnoticed_s({0, 1}, {3.0, 0.0, -0.15}, rest_s, rate_hz), 0.5) << rate_hz << " " << rest_s;
    }
}

TEST(Rest, ASlowTurnOnDeadEncodersIsNoRestOnceTheBiasIsKnown) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.01), 20.0, 7);
  Odometer odometer = learning(robot_with_gyro());
  run(odometer, drive.over({{10.0}}));
  drive.encoder_gain[0] = drive.encoder_gain[1] = 0.0;
  const double before = odometer.gyro_bias().rad_s;
  const Verdict verdict = run(odometer, drive.over({{5.0, 0.0, 0.02}}));
  EXPECT_FALSE(verdict.at_rest());
  EXPECT_EQ(verdict.stuck, 3U);
  EXPECT_NEAR(odometer.gyro_bias().rad_s, before, 1e-4);
  EXPECT_NEAR(odometer.pose().heading, 0.1, 0.003);
}

TEST(Rest, HealthyDrivingRaisesNoFlag) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    SensedDrive drive(with_bias(robot_with_gyro(), 0.01), 20.0, seed);
    Odometer odometer = learning(robot_with_gyro());
    for (const Increment& increment : drive.over({{3.0},
                                                  {10.0, 0.25, 0.0},
                                                  {4.0, 0.125, 0.5},
                                                  {4.0, 0.125, -0.5},
                                                  {2.0},
                                                  {5.0, 0.0, 1.0},
                                                  {3.0, 0.005, 0.01},
                                                  {10.0, -0.3, 0.1}}))
      ASSERT_EQ(odometer.step(increment).stuck, 0U) << increment.time_s;
  }
}

TEST(Rest, AGyroThatLagsRaisesNoFlag) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.01), 50.0, 11);
  std::vector<Increment> increments = drive.over({{3.0},
                                                  {2.0, 0.0, 0.8},
                                                  {1.0},
                                                  {2.0, 0.2, 0.8},
                                                  {0.3},
                                                  {2.0, 0.2, -0.8},
                                                  {2.0},
                                                  {2.0, 0.0, -0.8},
                                                  {2.0}});
  const int lag = 4;  // 80 ms
  for (std::size_t i = increments.size() - 1; i >= lag; --i)
    increments[i].gyro_rad = increments[i - lag].gyro_rad;
  Odometer odometer = learning(robot_with_gyro());
  for (const Increment& increment : increments)
    ASSERT_EQ(odometer.step(increment).stuck, 0U) << increment.time_s;
  EXPECT_NEAR(odometer.gyro_bias().rad_s, 0.01, 4.0 * std::sqrt(odometer.gyro_bias().variance));
}

TEST(Rest, AShakingAccelerometerIsNoRest) {
  SensedDrive drive(robot_with_gyro(), 20.0, 8);
  Odometer odometer = learning(robot_with_gyro());
  drive.shaking_m_s2 = 0.03;
  EXPECT_TRUE(run(odometer, drive.over({{2.0}})).at_rest());
  drive.encoder_gain[0] = drive.encoder_gain[1] = 0.0;
  drive.shaking_m_s2 = 0.4;
  const GyroBias before = odometer.gyro_bias();
  for (const Increment& increment : drive.over({{2.0, 0.3, 0.0}})) {
    const Verdict verdict = odometer.step(increment);
    EXPECT_TRUE(increment.time_s < 2.5 || !verdict.at_rest()) << increment.time_s;
  }
  EXPECT_NEAR(odometer.gyro_bias().rad_s, before.rad_s, 3.0 * std::sqrt(before.variance));
}

TEST(Rest, AGyroBeyondItsLimitIsNotUsed) {
  const Robot robot = robot_with_gyro();
  SensedDrive drive(robot, 20.0, 9);
  Odometer odometer = learning(robot);
  Increment increment = drive.next({1.0, 0.2, 0.0});
  increment.gyro_rad = 1.01 * robot.chassis.gyro->max_rate_rad_s * increment.duration_s;
  EXPECT_TRUE(odometer.step(increment).gyro_disturbed);
  EXPECT_NEAR(odometer.pose().heading, 0.0, 0.002);  // as the wheels say
  EXPECT_FALSE(odometer.step(drive.next({1.0, 0.2, 0.0})).gyro_disturbed);
}

TEST(Rest, ResumesFromItsBytes) {
  SensedDrive drive(with_bias(robot_with_gyro(), 0.01), 20.0, 10);
  const std::vector<Increment> increments =
      drive.over({{2.3}, {2.0, 0.2, 0.3}, {1.2}, {0.3, 0.1, 0.0}, {0.3}, {2.0, 0.1, 0.2}, {3.0}});
  Odometer whole = learning(robot_with_gyro());
  run(whole, increments);
  for (std::size_t at = 0; at < increments.size(); at += 7) {
    Odometer first = learning(robot_with_gyro());
    run(first, {increments.begin(), increments.begin() + static_cast<std::ptrdiff_t>(at)});
    Odometer second = learning(robot_with_gyro());
    second.resume(first.state());
    run(second, {increments.begin() + static_cast<std::ptrdiff_t>(at), increments.end()});
    ASSERT_EQ(std::memcmp(&second.state(), &whole.state(), sizeof(OdometerState)), 0) << at;
  }
}

TEST(Rest, TheBiasIsEitherLearnedOrAParameter) {
  const Odometer::Options options{.parameters = {{ParameterKind::gyro_bias, -1}}, .learn_gyro_bias = true};
  EXPECT_THROW(Odometer(robot_with_gyro(), options), InputError);
}

}  // namespace
}  // namespace trundle::odometry
