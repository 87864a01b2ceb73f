#include "trundle/odometry/odometer.hpp"

#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "increments.hpp"
#include "scale.hpp"

namespace trundle::odometry {
namespace {

using test::differential_robot;
using test::two_wheels;

void expect_near(const Pose2& a, const Pose2& b, double tolerance) {
  EXPECT_NEAR(a.x, b.x, tolerance);
  EXPECT_NEAR(a.y, b.y, tolerance);
  EXPECT_NEAR(a.heading, b.heading, tolerance);
}

TEST(Odometer, StraightStaysOnItsLine) {
  Odometer odometer(differential_robot(), {.start = {1.0, 2.0, 0.0}});
  for (int i = 0; i < 1000; ++i) odometer.step(two_wheels(0.01, 0.01));
  EXPECT_NEAR(odometer.pose().x, 11.0, 1e-12);
  EXPECT_EQ(odometer.pose().y, 2.0);
  EXPECT_EQ(odometer.pose().heading, 0.0);
}

TEST(Odometer, CircleClosesWhateverTheNumberOfSteps) {
  for (const int steps : {1, 2, 3, 7, 360, 10000}) {
    Odometer odometer(differential_robot(0.5), {.start = {0.3, -0.2, 0.7}});
    const double turn = 2.0 * kPi / steps;
    for (int i = 0; i < steps; ++i) odometer.step(two_wheels(turn * (1.0 - 0.25), turn * (1.0 + 0.25)));
    expect_near(odometer.pose(), {0.3, -0.2, 0.7 + 2.0 * kPi}, 1e-13 + 2e-16 * steps);  // rounding alone
  }
}

TEST(Odometer, PivotTurnsOnTheSpot) {
  Odometer odometer(differential_robot(0.5), {});
  for (int i = 0; i < 100; ++i) odometer.step(two_wheels(-0.01, 0.01));
  expect_near(odometer.pose(), {0.0, 0.0, 100 * 0.02 / 0.5}, 1e-12);
}

TEST(Odometer, DifferentialFormulas) {
  // dx = (dL + dR)/2, dθ = (dR − dL)/b, along an arc of radius dx/dθ.
  Odometer odometer(differential_robot(0.4), {});
  odometer.step(two_wheels(0.3, 0.5));
  const double turn = 0.2 / 0.4;
  const double radius = 0.4 / turn;
  expect_near(odometer.pose(), {radius * std::sin(turn), radius * (1.0 - std::cos(turn)), turn}, 1e-15);
}

TEST(Odometer, AnyChassisAsTheDefinitionSays) {
  const Chassis chassis[] = {differential_drive(test::kSize, 0.5),
                             test::with_gyro(differential_drive(test::kSize, 0.5)),
                             skid_steer(test::kSize, 0.7, 0.4),
                             test::scrubbing(),
                             test::with_gyro(test::scrubbing()),
                             omni3(test::kSize, 0.2),
                             mecanum(test::kSize, 0.4, 0.5),
                             test::two_pods(),
                             test::three_pods(),
                             test::odd_chassis(),
                             test::growing(differential_drive(test::kSize, 0.5)),
                             test::growing(test::with_gyro(test::scrubbing())),
                             Chassis{}};
  for (const Chassis& each : chassis) {
    const Robot robot = test::robot_of(each);
    const auto increments = test::wandering(robot, test::kSanitizers ? 40 : 400);
    Odometer fast(robot, {.with_covariance = false});
    Odometer full(robot, {});
    for (const Increment& increment : increments) fast.step(increment), full.step(increment);
    expect_near(fast.pose(), test::plainly_integrated(robot, robot.chassis, increments), 1e-8);
    EXPECT_EQ(fast.pose().x, full.pose().x);
    EXPECT_EQ(fast.pose().y, full.pose().y);
    EXPECT_EQ(fast.pose().heading, full.pose().heading);
  }
}

TEST(Odometer, TurnsBeyondTheFastRange) {
  // Several radians in one interval, and a heading of millions of radians.
  Odometer odometer(differential_robot(0.5), {.start = {0.0, 0.0, 3e6}});
  const Pose2 expected = Pose2{0.0, 0.0, 3e6} * exp({0.1, 0.0, 5.0});
  odometer.step(two_wheels(0.1 - 1.25, 0.1 + 1.25));
  expect_near(odometer.pose(), expected, 1e-9);
}

/// Left and right of a robot whose forward speed and turn rate never stay the same, read at both ends of
/// intervals of unlike lengths; and where it is, by a thousand arcs a second.
struct EverChanging {
  std::vector<Increment> increments;
  Pose2 end;
};
EverChanging ever_changing(double track_m, double interval_s) {
  constexpr double kStep_s = 1e-3;
  EverChanging drive;
  double time_s = 0.0;
  for (int i = 0; time_s < 20.0; ++i) {
    const auto steps = static_cast<int>(std::lround((i % 2 == 0 ? 0.8 : 1.2) * interval_s / kStep_s));
    Vector3 travel = Vector3::Zero();
    for (int k = 0; k < steps; ++k, time_s += kStep_s) {
      const double middle_s = time_s + 0.5 * kStep_s;
      const Vector3 twist =
          kStep_s * Vector3(0.4 + 0.3 * std::sin(1.3 * middle_s), 0.0, 1.2 * std::sin(0.9 * middle_s + 0.4));
      travel += twist;
      drive.end = drive.end * exp(Twist2::from(twist));
    }
    const double half = 0.5 * track_m * travel.z();
    drive.increments.push_back(two_wheels(travel.x() - half, travel.x() + half, steps * kStep_s));
  }
  return drive;
}

// Halving the interval quarters what an arc is off by; what is left by eq. 1a of docs/theory/calibration.md
// is of the next order.
TEST(Odometer, RatesMayChangeWithinAnInterval) {
  const Robot robot = differential_robot(0.5);
  double last_m = 0.0;
  for (const double interval_s : {0.2, 0.1, 0.05}) {
    const EverChanging drive = ever_changing(0.5, interval_s);
    Odometer arcs(robot, {}), bent(robot, {.rates_change = true});
    for (const Increment& increment : drive.increments) arcs.step(increment), bent.step(increment);
    const auto off = [&](const Odometer& odometer) {
      return (odometer.pose().translation() - drive.end.translation()).norm();
    };
    EXPECT_LT(off(bent), 0.2 * off(arcs)) << interval_s;
    if (last_m > 0.0) {
      EXPECT_LT(off(bent), 0.2 * last_m) << interval_s;
    }
    last_m = off(bent);
    EXPECT_NEAR(bent.pose().heading, arcs.pose().heading, 1e-15);
  }
}

TEST(Odometer, CopyContinuesOnItsOwn) {
  const Robot robot = differential_robot();
  Odometer odometer(robot, {.parameters = parameters_of(robot)});
  odometer.step(two_wheels(0.1, 0.2));
  Odometer copy = odometer;
  copy.step(two_wheels(0.1, 0.2));
  EXPECT_GT(copy.pose().x, odometer.pose().x);
  odometer.step(two_wheels(0.1, 0.2));
  EXPECT_EQ(copy.pose().x, odometer.pose().x);
  EXPECT_EQ(copy.sensitivity(), odometer.sensitivity());
}

TEST(Odometer, ResumesFromItsBytes) {
  const Robot robot = test::robot_of(test::three_pods());
  const auto increments = test::wandering(robot, 200);
  const Odometer::Options options{.parameters = parameters_of(robot)};
  Odometer whole(robot, options);
  for (const Increment& increment : increments) whole.step(increment);

  Odometer first(robot, options);
  for (int i = 0; i < 77; ++i) first.step(increments[static_cast<std::size_t>(i)]);
  std::array<std::byte, sizeof(OdometerState)> stored;
  std::memcpy(stored.data(), &first.state(), stored.size());

  OdometerState restored;
  std::memcpy(&restored, stored.data(), stored.size());
  Odometer second(robot, options);
  second.resume(restored);
  for (std::size_t i = 77; i < increments.size(); ++i) second.step(increments[i]);
  EXPECT_EQ(std::memcmp(&second.state(), &whole.state(), sizeof(OdometerState)), 0);
}

TEST(Odometer, SaysWhatItCannotObserve) {
  Chassis one_omni;
  one_omni.add({.kind = WheelKind::omni, .diameter_m = 0.1, .ticks_per_revolution = 1000});
  one_omni.gyro = Gyro{};
  try {
    const Odometer odometer(test::robot_of(one_omni), {});
    FAIL() << "sideways motion is not measured";
  } catch (const CannotAnswer& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("sideways motion"),
                                             testing::Not(testing::HasSubstr("turning"))));
  }
}

TEST(Odometer, RefusesTooManyParameters) {
  const Robot robot = differential_robot();
  const std::vector<Parameter> many(kMaxParameters + 1, Parameter{ParameterKind::track, -1});
  EXPECT_THROW(Odometer(robot, {.parameters = many}), InputError);
}

TEST(Odometer, KeepsTheTurnRateWhileTheGyroIsMissing) {
  const Robot robot = test::robot_of(test::two_pods());
  Increment increment{.duration_s = 0.1, .gyro_rad = 0.05, .has_gyro = true};
  Odometer odometer(robot, {});
  odometer.step(increment);
  const double before = odometer.white_covariance()(2, 2);
  increment.has_gyro = false;
  odometer.step(increment);
  EXPECT_NEAR(odometer.pose().heading, 0.10, 1e-12);
  const double added = odometer.white_covariance()(2, 2) - before;
  EXPECT_NEAR(added, kUnmeasuredTurn * kUnmeasuredTurn * 0.1, 1e-6);
}

TEST(Odometer, UsesTheWheelsWhereTheyTellTheTurn) {
  const Robot robot = test::robot_of(test::with_gyro(differential_drive(test::kSize, 0.5)));
  Odometer odometer(robot, {});
  odometer.step(two_wheels(-0.05, 0.05));
  EXPECT_NEAR(odometer.pose().heading, 0.2, 1e-12);
  EXPECT_LT(odometer.white_covariance()(2, 2), 1e-3);
}

}  // namespace
}  // namespace trundle::odometry
