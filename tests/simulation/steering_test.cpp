// Robots with steered wheels as they are simulated.
#include "trundle/simulation/steering.hpp"

#include <cmath>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "trundle/chassis/rows.hpp"

#include "robots.hpp"

namespace trundle::simulation {
namespace {

using test::exact_scenario;

constexpr WheelSize kWheel{.diameter_m = 0.1, .ticks_per_revolution = 1000.0};
constexpr SteeringSensor kExact{.sigma_rad = 0.0};
constexpr double kWheelbase_m = 0.4;

struct SteeredRobot {
  const char* name;
  Chassis chassis;
};

Robot exact_robot(const Chassis& chassis) {
  Robot robot;
  robot.chassis = chassis;
  robot.chassis.noise = {0.0, 0.0, 0.0, 0.0, 0.0};
  for (int i = 0; i < chassis.wheel_count; ++i) robot.wheel_names.push_back(fmt::format("w{}", i));
  for (int i = 0; i < chassis.passive_count; ++i) robot.passive_names.push_back(fmt::format("p{}", i));
  return robot;
}

Robot exact_tricycle() {
  return exact_robot(tricycle(kWheel, kWheelbase_m, kExact));
}

/// Odometry of what wheels and steering read at the moments, the angle of an interval as the aligner has it:
/// halfway between its ends.
Pose2 reckoned(const Drive& drive, const Chassis& chassis) {
  Pose2 pose = drive.moments.front().body;
  const Rows rows = rows_of(chassis, false);
  for (std::size_t i = 1; i < drive.moments.size(); ++i) {
    const Moment &before = drive.moments[i - 1], &after = drive.moments[i];
    Increment increment{.time_s = after.time_s, .duration_s = after.time_s - before.time_s};
    for (std::size_t w = 0; w < increment.turned.size(); ++w) {
      increment.turned[w] = after.turned[w] - before.turned[w];
      increment.steering_rad[w] = 0.5 * (before.steering_rad[w] + after.steering_rad[w]);
    }
    pose = pose * exp(twist_of(chassis, rows, increment));
  }
  return pose;
}

Path curves() {
  return joined({straight(1.0),
                 {Segment{{2.0, 0.0, 2.0}, 10.0}},
                 straight(0.5),
                 {Segment{{-1.0, 0.0, 1.0}, 5.0}},
                 pause(1.0),
                 turn_on_the_spot(-1.2),
                 straight(-0.5)});
}

double off(const Pose2& a, const Pose2& b) {
  return log(a.inverse() * b).vector().norm();
}

class EverySteeredRobot : public testing::TestWithParam<SteeredRobot> {};

// What is left is how far the angle in the middle of an interval differs from the mean of its ends, while it
// changes: the less, the shorter the interval.
TEST_P(EverySteeredRobot, OdometryEndsAtTheTruthWhicheverRobotDrives) {
  const Robot robot = exact_robot(GetParam().chassis);
  for (const Steering steering : {Steering::odometry, Steering::truth}) {
    double before = 1.0;
    for (const double rate_hz : {20.0, 80.0, 320.0}) {
      Scenario scenario = exact_scenario(robot, robot, curves());
      scenario.steering = steering;
      scenario.encoders.rate_hz = rate_hz;
      const Drive driven = drive(scenario);
      const double error = off(driven.moments.back().body, reckoned(driven, robot.chassis));
      EXPECT_LT(error, before);
      before = 0.3 * error;
    }
  }
}

TEST_P(EverySteeredRobot, ACircleIsReadExactly) {
  const Robot robot = exact_robot(GetParam().chassis);
  const Drive driven = drive(exact_scenario(robot, robot, circle(0.8, 1.0, TurnSense::cw)));
  EXPECT_LT(off(driven.moments.back().body, reckoned(driven, robot.chassis)), 1e-9);
  EXPECT_LT(driven.moments.back().body.translation().norm(), 1e-9);  // closed, though it starts ramped
}

INSTANTIATE_TEST_SUITE_P(
    Robots, EverySteeredRobot,
    testing::Values(SteeredRobot{"tricycle", tricycle(kWheel, kWheelbase_m, kExact)},
                    SteeredRobot{"car", ackermann(kWheel, 0.3, kWheelbase_m, 0.0, kExact)},
                    SteeredRobot{"car_of_two_steerings", ackermann(kWheel, 0.3, kWheelbase_m, 0.3, kExact)},
                    SteeredRobot{"swerve", swerve(kWheel, 0.3, kWheelbase_m, kExact)}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(Steering, OfATricycleStandsAsTheCurveAsks) {
  const Robot robot = exact_tricycle();
  const Drive arc = drive(exact_scenario(robot, robot, {Segment{{4.0, 0.0, 4.0}, 20.0}}));
  EXPECT_NEAR(arc.moments[100].steering_rad[0], std::atan(kWheelbase_m), 1e-12);  // radius 1 m
  const Drive back = drive(exact_scenario(robot, robot, {Segment{{-4.0, 0.0, 4.0}, 20.0}}));
  EXPECT_NEAR(back.moments[100].steering_rad[0], std::atan(-kWheelbase_m), 1e-12);
  EXPECT_LT(back.moments[100].turned[0], 0.0);
}

TEST(Steering, TurnsWhileTheRobotRestsBeforeATurnOnTheSpot) {
  const Robot robot = exact_tricycle();
  const Drive driven =
      drive(exact_scenario(robot, robot, joined({straight(1.0), pause(1.0), turn_on_the_spot(1.0)})));
  double fastest = 0.0;
  for (std::size_t i = 1; i < driven.moments.size(); ++i) {
    const Moment &before = driven.moments[i - 1], &after = driven.moments[i];
    const double rate =
        std::abs(after.steering_rad[0] - before.steering_rad[0]) / (after.time_s - before.time_s);
    fastest = std::max(fastest, rate);
    if (rate > 0.0) {
      EXPECT_EQ(before.turned[0], after.turned[0]) << before.time_s;
    }
  }
  EXPECT_NEAR(driven.moments.back().steering_rad[0], 0.5 * kPi, 1e-12);
  EXPECT_NEAR(fastest, 0.5 * kPi / 0.75, 1e-9);  // 1 s of rest, of which the ramp takes a quarter
}

TEST(Steering, ReadsByItsZeroScaleClockAndCounts) {
  Robot truth = exact_tricycle();
  SteeringSensor& steering = *truth.chassis.wheels()[0].steering;
  steering.zero_rad = 0.1;
  steering.scale = -2.0;
  Scenario scenario = exact_scenario(exact_tricycle(), truth, {Segment{{4.0, 0.0, 4.0}, 20.0}});
  scenario.steering = Steering::truth;
  const double angle = std::atan(kWheelbase_m);
  const auto read = [&] { return read_steering(scenario, drive(scenario)).front(); };
  EXPECT_EQ(read().wheel, "w0");
  EXPECT_NEAR(read().value[100], 0.1 - 0.5 * angle, 1e-12);
  scenario.truth.chassis.wheels()[0].steering->ticks_per_revolution = 4096.0;
  scenario.steered.unit = WheelUnit::ticks;
  EXPECT_EQ(read().value[100], std::round((0.1 - 0.5 * angle) / (2.0 * kPi) * 4096.0));

  // Its stamps are early by the offset: at the first one it reads what is true that much later.
  scenario.truth = exact_tricycle();
  scenario.steered = {.ramp_s = 1.0};
  const double later = read().value[6];
  scenario.truth.chassis.wheels()[0].steering->time_offset_s = 0.1;
  EXPECT_NEAR(read().value[4], later, 1e-12);  // 0.1 s are two samples
}

TEST(Steering, NoiseOfReadingsHasItsSigma) {
  constexpr double sigma = 0.01;
  Robot truth = exact_tricycle();
  truth.chassis.wheels()[0].steering->sigma_rad = sigma;
  const Scenario scenario = exact_scenario(truth, truth, straight(200.0));
  double sum2 = 0.0;
  const auto readings = read_steering(scenario, drive(scenario)).front().value;
  for (const double reading : readings) sum2 += reading * reading;
  const auto n = static_cast<double>(readings.size());
  EXPECT_NEAR(sum2 / n / (sigma * sigma), 1.0, 4.0 * std::sqrt(2.0 / n));
}

// The front axle's skid turns a tricycle, the rear one's moves it: independent, ε_f − ε_r = L dθ.
TEST(Steering, SkidOfATricycleTurnsIt) {
  constexpr double per_sqrt_m = 0.01, L = 9.0;
  constexpr int n = 1000;
  for (const Steering steering : {Steering::odometry, Steering::truth}) {
    Robot truth = exact_tricycle();
    truth.chassis.noise.lateral_per_sqrt_m = per_sqrt_m;
    double sum2 = 0.0;
    for (int i = 0; i < n; ++i) {
      Scenario scenario = exact_scenario(exact_tricycle(), truth, straight(L));
      scenario.encoders.rate_hz = 1.0;
      scenario.steering = steering;
      scenario.seed = static_cast<std::uint64_t>(i);
      const double heading = drive(scenario).moments.back().body.heading;
      sum2 += heading * heading;
    }
    const double expected = 2.0 * per_sqrt_m * per_sqrt_m * L / (kWheelbase_m * kWheelbase_m);
    EXPECT_NEAR(sum2 / n / expected, 1.0, 4.0 * std::sqrt(2.0 / (n - 1)));
  }
}

// Its front wheel stands across it, where its lateral row shows no turn.
TEST(Steering, SkidMovesATricycleThatTurnsOnTheSpotByItsNoise) {
  Robot truth = exact_tricycle();
  truth.chassis.noise.lateral_per_sqrt_m = 0.01;
  for (const Steering steering : {Steering::odometry, Steering::truth}) {
    Scenario scenario = exact_scenario(exact_tricycle(), truth, turn_on_the_spot(6.0));
    scenario.steering = steering;
    const Pose2 end = drive(scenario).moments.back().body;
    const double skid_m = 0.01 * std::sqrt(6.0 * kWheelbase_m);  // 1σ of each wheel's
    EXPECT_NEAR(end.heading, 6.0, 5.0 * skid_m / kWheelbase_m);
    EXPECT_LT(end.translation().norm(), 5.0 * std::sqrt(2.0) * skid_m);
  }
}

}  // namespace
}  // namespace trundle::simulation
