// Which wheel slipped: where the rows can tell, where only the motion can, and where nothing can.
#include <cmath>

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/inspection/inspect.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/slip/find_slip.hpp"

#include "chassis/robots.hpp"
#include "scale.hpp"
#include "slip/nees.hpp"

namespace trundle::slip {
using namespace inspection;
namespace {

struct Tally {
  int detected = 0;
  int right = 0;
  int ambiguous = 0;
  int wrong = 0;
  int right_kind = 0;
  double excess_error_m = 0.0;  ///< sum
  double excess_z2 = 0.0;       ///< sum of the squares of the error in its own sigmas
  double nees = 0.0;            ///< sum over the runs, of the corrected end
  double end_error_m = 0.0;     ///< likewise
};

Robot robot_with_noise(Chassis chassis) {
  chassis.noise.wheel_per_sqrt_m = 0.002;
  if (chassis.gyro) chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4, .bias_sigma_rad_s = 0.0};
  return test::robot_of(chassis);
}

Chassis with_quiet_gyro(Chassis chassis) {
  chassis.gyro = Gyro{};
  return chassis;
}

/// A motion at a constant speed, the robot's own kinds of motion only.
Twist2 random_velocity(bool sideways, bool turning, Random& random) {
  const double forward = (random.below(2) == 0 ? 1.0 : -1.0) * random.uniform(0.2, 0.4);
  return {forward, sideways ? random.uniform(-0.3, 0.3) : 0.0, turning ? random.uniform(-0.3, 0.3) : 0.0};
}

Twist2 scaled(const Twist2& velocity, double s) {
  return Twist2::from(s * velocity.vector());
}

/// One burst of one wheel in six seconds of driving.
Scenario burst_scenario(const Robot& robot, const Twist2& velocity, Random& random) {
  Scenario scenario;
  scenario.nominal = robot;
  scenario.truth = robot;
  scenario.steering = Steering::truth;
  scenario.path = {{scaled(velocity, 6.0), 6.0}};
  scenario.seed = random.bits();
  SlipBurst burst;
  burst.wheel = static_cast<int>(random.below(static_cast<std::uint64_t>(robot.chassis.wheel_count)));
  burst.span = {random.uniform(2.5, 4.0), random.uniform(0.25, 1.0)};
  const bool spins = random.below(2) == 0;
  burst.factor = spins ? random.uniform(1.3, 2.0) : random.uniform(0.0, 0.7);
  scenario.slips = {burst};
  return scenario;
}

bool overlaps(const SlipEvent& event, const SlipTruth& slip) {
  return event.start_s < slip.span.end_s() && slip.span.start_s < event.end_s;
}

/// `spin_odds`: half of the bursts spin, whatever the motors do.
void judge(const Scenario& scenario, const VelocityStream& commands, Tally& tally,
           double spin_odds = SlipOptions{}.spin_odds) {
  const Simulation run = simulate(scenario);
  const SlipTruth& slip = run.truth.slips.front();
  const AlignedReadings readings = align(run.recording, scenario.nominal);
  const SlipReport report =
      find_slip(readings, commands, scenario.nominal, {.probability = 1e-3, .spin_odds = spin_odds});
  tally.nees += nees_at_end(corrected(readings, report, scenario.nominal), scenario.nominal, run.truth.body);
  tally.end_error_m += (report.end.translation() - run.truth.body.poses.back().pose.translation()).norm();
  for (const SlipEvent& event : report.events) {
    if (!overlaps(event, slip)) continue;
    ++tally.detected;
    if (event.wheel == kAmbiguous) {
      ++tally.ambiguous;
    } else if (event.wheel == slip.wheel) {
      ++tally.right;
      tally.right_kind += (event.kind == SlipKind::spin) == slip.spins() ? 1 : 0;
      const double error_m = event.excess_m - slip.excess_m;
      tally.excess_error_m += std::abs(error_m);
      tally.excess_z2 += std::pow(error_m / event.excess_sigma_m, 2);
    } else {
      ++tally.wrong;
    }
  }
}

void tell(const char* robot, const Tally& t) {
  fmt::print(
      "  {:<34} {} slips: right {:.2f} %, ambiguous {:.2f} %, wrong {:.2f} %; of the right ones kind {:.2f} "
      "%, "
      "excess within {:.1f} mm on average, rms {:.2f} sigma\n",
      robot, t.detected, 100.0 * t.right / t.detected, 100.0 * t.ambiguous / t.detected,
      100.0 * t.wrong / t.detected, 100.0 * t.right_kind / std::max(1, t.right),
      1000.0 * t.excess_error_m / std::max(1, t.right), std::sqrt(t.excess_z2 / std::max(1, t.right)));
}

Tally attributions(const Robot& robot, bool sideways, bool turning,
                   double spin_odds = SlipOptions{}.spin_odds) {
  Random random(7);
  Tally tally;
  const int runs = test::trials(1000, 100);
  for (int i = 0; i < runs; ++i)
    judge(burst_scenario(robot, random_velocity(sideways, turning, random), random), {}, tally, spin_odds);
  return tally;
}

/// χ² of the excesses; beginnings and ends that no interval shows make it some percent larger.
void expect_honest_excess(const Tally& tally) {
  const double chance = 4.0 * std::sqrt(2.0 / tally.right);
  EXPECT_GT(tally.excess_z2 / tally.right, 1.0 - chance);
  EXPECT_LT(tally.excess_z2 / tally.right, 1.15 + chance);
}

void expect_told_apart(const char* name, const Tally& tally) {
  tell(name, tally);
  ASSERT_GT(tally.detected, 50);
  EXPECT_GE(tally.right, 0.97 * tally.detected);
  EXPECT_LE(tally.ambiguous, 0.02 * tally.detected);
  EXPECT_LE(tally.wrong, 0.01 * tally.detected);
  EXPECT_GE(tally.right_kind, 0.97 * tally.right);
  expect_honest_excess(tally);
}

TEST(Attribution, MecanumWithTwoPodsAndGyro) {
  const Robot robot = robot_with_noise(test::joined(mecanum(test::kSize, 0.4, 0.5), test::two_pods()));
  expect_told_apart("mecanum, two pods, gyro", attributions(robot, true, true));
}

TEST(Attribution, Omni3WithTwoPodsAndGyro) {
  const Robot robot = robot_with_noise(test::joined(omni3(test::kSize, 0.2), test::two_pods()));
  expect_told_apart("omni-3, two pods, gyro", attributions(robot, true, true));
}

TEST(Attribution, SkidSteerWithFourEncodersAndGyro) {
  const Robot robot = robot_with_noise(with_quiet_gyro(skid_steer(test::kSize, 0.6, 0.5)));
  expect_told_apart("skid-steer, four encoders, gyro", attributions(robot, false, true));
}

TEST(Attribution, DrivenWheelsAgainstDeadWheels) {
  const Robot robot =
      robot_with_noise(test::joined(differential_drive(test::kSize, 0.4), test::three_pods()));
  expect_told_apart("differential, three pods, gyro", attributions(robot, false, true));
}

// Eight rows for three motions.
TEST(Attribution, SwerveWithoutGyro) {
  const Robot robot = robot_with_noise(swerve(test::kSize, 0.4, 0.5));
  expect_told_apart("swerve", attributions(robot, true, true));
}

TEST(Attribution, SwerveWithGyro) {
  const Robot robot = robot_with_noise(with_quiet_gyro(swerve(test::kSize, 0.4, 0.5)));
  expect_told_apart("swerve, gyro", attributions(robot, true, true));
}

// One degree of freedom: the residual says that something slips, the change of each wheel says which.
TEST(Attribution, DifferentialWithGyroAtConstantCommand) {
  const Robot robot = robot_with_noise(with_quiet_gyro(differential_drive(test::kSize, 0.5)));
  expect_told_apart("differential, gyro, steady", attributions(robot, false, true));
}

// Front and rear wheel of a side have the same row: without a gyro their errors are each other's mirror.
TEST(Attribution, IsAmbiguousWhereRowsCannotBeToldApart) {
  Robot robot = robot_with_noise(skid_steer(test::kSize, 0.6, 0.5));
  robot.wheel_names = {"front_left", "front_right", "rear_left", "rear_right"};
  const Tally tally = attributions(robot, false, true, 1.0);
  tell("skid-steer, four encoders", tally);
  ASSERT_GT(tally.detected, 50);
  EXPECT_GE(tally.ambiguous, 0.99 * tally.detected);
  EXPECT_THAT(abilities_of(robot, false).cannot,
              testing::Contains(testing::HasSubstr("'front_left' from 'rear_left'")));
}

// The same robot as above whose speed changes all the time: what its wheels did before is no guide.
TEST(Attribution, IsAmbiguousWithOneDegreeOfFreedomWhileTheCommandChanges) {
  const Robot robot = robot_with_noise(with_quiet_gyro(differential_drive(test::kSize, 0.5)));
  Random random(8);
  Tally with_commands;
  Tally without;
  const int runs = test::trials(500, 100);
  for (int i = 0; i < runs; ++i) {
    Scenario scenario = burst_scenario(robot, {}, random);
    scenario.path.clear();
    VelocityStream commands;
    double clock = 0.0;
    while (clock < 6.0) {
      const Twist2 velocity = random_velocity(false, true, random);
      commands.time_s.push_back(clock + 0.01);
      commands.forward_m_s.push_back(velocity.dx);
      commands.yaw_rate_rad_s.push_back(velocity.dtheta);
      scenario.path.push_back({scaled(velocity, 0.25), 0.25});
      clock += 0.25;
    }
    judge(scenario, commands, with_commands, 1.0);
    judge(scenario, {}, without, 1.0);
  }
  tell("differential, gyro, commands change", with_commands);
  tell("the same, commands unknown", without);
  fmt::print("  at the end {:.1f} mm off on average, NEES {:.2f}\n", 1e3 * with_commands.end_error_m / runs,
             with_commands.nees / runs);
  EXPECT_LT(with_commands.nees / runs, 3.0 + 4.0 * std::sqrt(6.0 / runs));
  EXPECT_GT(with_commands.nees / runs, 1.3);  // 1.8: of two alternatives the error is never far out
  EXPECT_GE(with_commands.ambiguous, 0.99 * with_commands.detected);
  EXPECT_GE(without.ambiguous, 0.99 * without.detected);
  EXPECT_THAT(abilities_of(robot, true).cannot, testing::Contains(testing::HasSubstr("'w0' from 'w1'")));
}

/// Of the likeliest wheels of slips, named or not: how many are right, and should be by their confidence.
struct Calibration {
  int slips = 0;
  int right = 0;
  double confidence = 0.0;
  double variance = 0.0;
  int sure_and_wrong = 0;  ///< with a confidence beyond 0.95
  double nees = 0.0;       ///< sum over the runs, of the corrected end
  double nees2 = 0.0;      ///< of its squares
  double sure = 0.0;       ///< how many should be sure and wrong, by their confidence
  double sure_variance = 0.0;
};

/// A wheel slips for a second, by 0.12 m, while the robot takes another speed within 0.3 s or just before.
Scenario changing_scenario(const Robot& robot, bool slows, bool spins, Random& random) {
  constexpr double kChange_s = 0.3, kStep_s = 0.05, kFast_m_s = 0.3, kSlow_m_s = 0.15;
  const double before_m_s = slows ? kFast_m_s : kSlow_m_s, after_m_s = slows ? kSlow_m_s : kFast_m_s;
  Scenario scenario;
  scenario.nominal = robot;
  scenario.truth = robot;
  scenario.steering = Steering::truth;
  const double start_s = random.uniform(4.0, 5.0);
  scenario.path = {{{before_m_s * start_s, 0.0, 0.0}, start_s}};
  for (double t = 0.5 * kStep_s; t < kChange_s; t += kStep_s) {
    const double speed_m_s = before_m_s + (after_m_s - before_m_s) * t / kChange_s;
    scenario.path.push_back({{speed_m_s * kStep_s, 0.0, 0.0}, kStep_s});
  }
  scenario.path.push_back({{after_m_s * 4.0, 0.0, 0.0}, 4.0});
  scenario.seed = random.bits();
  SlipBurst burst;
  burst.wheel = static_cast<int>(random.below(2));
  burst.span = {start_s + random.uniform(-0.25, 0.6), 1.0};
  burst.factor = 1.0;
  burst.excess_m_s = spins ? 0.12 : -0.12;
  scenario.slips = {burst};
  return scenario;
}

/// With two wheels and a gyro the sign of the excess says which wheel it would be.
void calibrate(const Scenario& scenario, double spin_odds, Calibration& sum) {
  const Simulation run = simulate(scenario);
  const SlipTruth& slip = run.truth.slips.front();
  const AlignedReadings readings = align(run.recording, scenario.nominal);
  const SlipReport report =
      find_slip(readings, {}, scenario.nominal, {.probability = 1e-3, .spin_odds = spin_odds});
  const double nees =
      nees_at_end(corrected(readings, report, scenario.nominal), scenario.nominal, run.truth.body);
  sum.nees += nees;
  sum.nees2 += nees * nees;
  for (const SlipEvent& event : report.events) {
    if (!overlaps(event, slip)) continue;
    const bool right = event.excess_m * slip.excess_m > 0.0;
    ++sum.slips;
    sum.right += right ? 1 : 0;
    sum.confidence += event.confidence;
    sum.variance += event.confidence * (1.0 - event.confidence);
    if (event.confidence > 0.95) {
      sum.sure_and_wrong += right ? 0 : 1;
      sum.sure += 1.0 - event.confidence;
      sum.sure_variance += event.confidence * (1.0 - event.confidence);
    }
    EXPECT_EQ(event.wheel == kAmbiguous, event.confidence < 0.9);
  }
}

void tell(const char* what, const Calibration& c, int runs) {
  fmt::print(
      "  {:<34} {} slips: {} right, {:.1f} by their confidence, {} sure and wrong ({:.1f}), NEES {:.2f}\n",
      what, c.slips, c.right, c.confidence, c.sure_and_wrong, c.sure, c.nees / runs);
}

// A motion that changes as a wheel slips looks like the other wheel's slip in a steady one.
TEST(Attribution, IsAsSureAsItIsRightWhereTheMotionChangesAtTheSlip) {
  const Robot robot = robot_with_noise(with_quiet_gyro(differential_drive(test::kSize, 0.5)));
  Random random(9);
  Calibration sum;
  const int runs = test::trials(400, 100);
  for (int i = 0; i < runs; ++i)
    calibrate(changing_scenario(robot, random.below(2) == 0, random.below(2) == 0, random), 1.0, sum);
  tell("differential, gyro, speed changes", sum, runs);
  ASSERT_GE(sum.slips, runs);
  EXPECT_GE(sum.right, sum.confidence - 4.0 * std::sqrt(sum.variance));
  // Counts that rare follow Poisson's distribution, whose tail is wider by some one.
  EXPECT_LE(sum.sure_and_wrong, sum.sure + 4.0 * std::sqrt(sum.sure_variance) + 1.0);
  // The rare wheel that is likely and wrong is off by many sigmas: its NEES is no χ², the spread is measured.
  const double mean = sum.nees / runs;
  EXPECT_LT(mean, 3.0 + 4.0 * std::sqrt(std::max(6.0, sum.nees2 / runs - mean * mean) / runs));
}

// One that spins although the motors brake is unlikely by the odds, and by nothing else.
TEST(Attribution, AWheelThatSpinsAsTheRobotSlowsDownIsNotSurelyTheOther) {
  const Robot robot = robot_with_noise(with_quiet_gyro(differential_drive(test::kSize, 0.5)));
  Random random(10);
  Calibration sum;
  const int runs = test::trials(100, 50);
  for (int i = 0; i < runs; ++i)
    calibrate(changing_scenario(robot, true, true, random), SlipOptions{}.spin_odds, sum);
  tell("differential, gyro, spins while slowing", sum, runs);
  ASSERT_GE(sum.slips, runs);
  EXPECT_LE(sum.sure_and_wrong, 0.05 * sum.slips);
  EXPECT_LT(sum.nees / runs, 3.0 + 4.0 * std::sqrt(6.0 / runs));
}

}  // namespace
}  // namespace trundle::slip
