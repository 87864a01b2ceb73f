// Slip of robots whose wheels with encoders are steered: H changes with every angle, what contradicts itself
// does not.
#include <cmath>

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/slip/find_slip.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "chassis/robots.hpp"
#include "scale.hpp"
#include "slip/nees.hpp"

namespace trundle::slip {
namespace {

constexpr double kPart_s = 0.05;
constexpr SteeringSensor kRead{.sigma_rad = radians(0.5)};

/// Two driven wheels on the rear axle and two steered ones in front, all with encoders.
Chassis car_with_four_encoders() {
  Chassis chassis = differential_drive(test::kSize, 0.4);
  for (const double y : {0.2, -0.2})
    chassis.add({.x_m = 0.6,
                 .y_m = y,
                 .diameter_m = test::kSize.diameter_m,
                 .ticks_per_revolution = test::kSize.ticks_per_revolution,
                 .steering = kRead});
  return chassis;
}

Chassis with_known_gyro(Chassis chassis) {
  chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4, .bias_walk_rad_s_sqrt_s = 0.0, .bias_sigma_rad_s = 0.0};
  return chassis;
}

struct SteeredCase {
  const char* name;
  Chassis chassis;
  bool sideways;  ///< it can drive so
  int degrees_of_freedom;
};
void PrintTo(const SteeredCase& robot, std::ostream* out) {
  *out << robot.name;
}

const SteeredCase kSwerve{"swerve", swerve(test::kSize, 0.4, 0.5, kRead), true, 5};
const SteeredCase kSwerveWithGyro{"swerve, gyro", with_known_gyro(kSwerve.chassis), true, 6};
const SteeredCase kCar{"car, four encoders", car_with_four_encoders(), false, 4};
const SteeredCase kTricycleWithGyro{"tricycle, gyro", with_known_gyro(tricycle(test::kSize, 0.6, kRead)),
                                    false, 1};

Robot robot_of(const SteeredCase& robot) {
  Robot result = test::robot_of(robot.chassis);
  result.name = robot.name;
  result.chassis.noise.wheel_per_sqrt_m = 0.002;
  return result;
}

Twist2 random_motion(bool sideways, Random& random) {
  const double forward = (random.below(2) == 0 ? 1.0 : -1.0) * random.uniform(0.01, 0.02);
  return {forward, sideways ? random.uniform(-0.015, 0.015) : 0.0, random.uniform(-0.015, 0.015)};
}

/// What the robot reads of a motion, with Gaussian noise as its file states it: of travel, of each angle, of
/// how far steered wheels skid, which their angles show, and of how far an axle at the origin does, which
/// moves the robot.
Increment noisy_increment(const Robot& robot, bool has_axle, Twist2 motion, Random& random) {
  const Chassis& chassis = robot.chassis;
  const Increment clean = test::steered_increment_of(chassis, motion, kPart_s);
  const double skid_sigma_m = std::sqrt(lateral_variance(chassis, mean_travel(chassis, clean)));
  if (has_axle) motion.dy += random.normal(skid_sigma_m);
  Increment increment = test::steered_increment_of(chassis, motion, kPart_s);
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    const Wheel& wheel = chassis.wheels()[i];
    const double metres = kPi * wheel.diameter_m, travel_m = metres * increment.turned[i];
    increment.turned[i] +=
        random.normal(std::sqrt(rolling_variance(chassis, i, std::abs(travel_m)))) / metres;
    if (wheel.steering)
      increment.steering_rad[i] +=
          random.normal(wheel.steering->sigma_rad) + random.normal(skid_sigma_m) / travel_m;
  }
  if (chassis.gyro)
    increment.gyro_rad += random.normal(chassis.gyro->noise_rad_s_sqrt_hz * std::sqrt(kPart_s));
  return increment;
}

/// `count` is that of trials with probability p, but for one case in a thousand.
void expect_share(int count, int trials, double p, const char* what) {
  EXPECT_NEAR(count, trials * p, normal_limit(1e-3) * std::sqrt(trials * p * (1.0 - p)) + 1.0) << what;
}

class SteeredSlip : public testing::TestWithParam<SteeredCase> {};
INSTANTIATE_TEST_SUITE_P(Robots, SteeredSlip,
                         testing::Values(kSwerve, kSwerveWithGyro, kCar, kTricycleWithGyro),
                         [](const auto& test) {
                           std::string name = test.param.name;
                           std::erase_if(name, [](char c) { return c == ' ' || c == ','; });
                           return name;
                         });

TEST_P(SteeredSlip, HasAsManyDegreesOfFreedomAsRowsMoreThanMotions) {
  const Parity parity(robot_of(GetParam()));
  EXPECT_EQ(parity.degrees_of_freedom(), GetParam().degrees_of_freedom);
  EXPECT_TRUE(can_show_slip(GetParam().chassis, true));
}

// However the motion changes within an interval: readings without noise do not contradict each other.
TEST_P(SteeredSlip, OneIntervalHoldsMotionsInAllDirections) {
  const Robot robot = robot_of(GetParam());
  const Parity parity(robot);
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    IncrementMerger merger(robot.chassis, 0.25);
    std::optional<Increment> interval;
    while (!interval)
      interval = merger.add(
          test::steered_increment_of(robot.chassis, random_motion(GetParam().sideways, random), kPart_s));
    const JudgedInterval judged{
        *interval, {robot.chassis.gyro ? robot.chassis.gyro->bias_rad_s : 0.0, 0.0}, 0.0, merger.contacts()};
    EXPECT_LT(parity.contradiction(judged, nullptr).chi2, 1e-12);
  }
}

TEST_P(SteeredSlip, FalseAlarmsAreAsManyAsAskedFor) {
  Robot robot = robot_of(GetParam());
  for (Wheel& wheel : robot.chassis.wheels()) wheel.ticks_per_revolution = 0.0;  // Gaussian, without rounding
  const Parity parity(robot);
  const std::array<double, 3> p = {1e-2, 1e-3, 1e-4};
  std::array<int, 3> alarms{};
  Random random(2);
  const int intervals = test::trials(300'000, 2000);
  for (int i = 0; i < intervals; ++i) {
    IncrementMerger merger(robot.chassis, 0.25);
    const Twist2 motion = random_motion(GetParam().sideways, random);
    std::optional<Increment> interval;
    while (!interval) interval = merger.add(noisy_increment(robot, !GetParam().sideways, motion, random));
    const double chi2 = parity.contradiction({*interval, {}, 0.0, merger.contacts()}, nullptr).chi2;
    for (std::size_t k = 0; k < p.size(); ++k)
      alarms[k] += chi2 > chi_squared_limit(p[k], parity.degrees_of_freedom()) ? 1 : 0;
  }
  for (std::size_t k = 0; k < p.size(); ++k) {
    fmt::print("  {:<20} wanted {}: {} of {} = {:.4g}\n", GetParam().name, p[k], alarms[k], intervals,
               alarms[k] / double(intervals));
    expect_share(alarms[k], intervals, p[k], GetParam().name);
  }
}

TEST(SteeredSlipRefusal, ATricycleWithoutAGyroHasNoRedundantReadingAndSaysSo) {
  const Robot robot = test::robot_of(tricycle(test::kSize, 0.6, kRead));
  EXPECT_FALSE(can_show_slip(robot.chassis, true));
  try {
    const Parity parity(robot);
    FAIL();
  } catch (const CannotAnswer& e) {
    EXPECT_STREQ(e.what(),
                 "robot 'test': slip is not observable: no redundant measurement; a gyro or another wheel "
                 "with an encoder "
                 "would be one");
  }
}

/// A drive of the kinds of motion that the robot has, turns on the spot among them.
Scenario drive_of(const SteeredCase& robot, std::uint64_t seed, double seconds) {
  Scenario scenario;
  scenario.nominal = robot_of(robot);
  scenario.truth = scenario.nominal;
  scenario.steering = Steering::truth;
  scenario.seed = seed;
  Random random(seed, 7);
  scenario.path = pause(1.0);
  for (double clock = 0.0; clock < seconds; clock += 2.0) {
    const double forward = (random.below(4) == 0 ? -1.0 : 1.0) * random.uniform(0.2, 0.5);
    const Twist2 velocity{forward, robot.sideways ? random.uniform(-0.4, 0.4) : 0.0,
                          random.uniform(-0.5, 0.5)};
    scenario.path.push_back({Twist2::from(2.0 * velocity.vector()), 2.0});
  }
  return scenario;
}

// As a robot is: whole counts of travel and of angle, at 50 Hz, of modules that swing to a new angle within a
// quarter of a second; the robot file states the noise as it is. Rounding errors that are taken as
// independent make alarms rarer.
TEST_P(SteeredSlip, RaisesNoMoreFalseAlarmsThanAskedForWithCountsAndSwings) {
  SteeredCase robot = GetParam();
  for (Wheel& wheel : robot.chassis.all_wheels())
    if (wheel.steering) wheel.steering->ticks_per_revolution = 4096.0;
  constexpr double kP = 0.01;
  SlipCounts sum;
  const auto seeds = static_cast<std::uint64_t>(test::trials(40, 5));
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    Scenario scenario = drive_of(robot, seed, 60.0);
    scenario.encoders.rate_hz = 50.0;
    scenario.steered.unit = WheelUnit::ticks;
    const Simulation run = simulate(scenario);
    const SlipCounts counts =
        find_slip(align(run.recording, scenario.nominal), {}, scenario.nominal, {.probability = kP}).counts;
    sum.judged += counts.judged;
    sum.alarms += counts.alarms;
    sum.slipping += counts.slipping;
  }
  const auto judged = static_cast<double>(sum.judged);
  fmt::print("  {:<20} {} alarms, {} within a slip, of {}: {:.4f}, {:.4f}\n", robot.name, sum.alarms,
             sum.slipping, sum.judged, static_cast<double>(sum.alarms) / judged,
             static_cast<double>(sum.slipping) / judged);
  EXPECT_LE(static_cast<double>(sum.alarms), kP * judged + normal_limit(1e-3) * std::sqrt(kP * judged));
}

// --- which wheel, and what of it

/// How slips of one wheel, and angles of one wheel that are misread, are attributed.
struct SteeredTally {
  int runs = 0;
  int found = 0;      ///< with an event that overlaps
  int right = 0;      ///< of the events: wheel and kind
  int kind_open = 0;  ///< the wheel is right, its kind unknown
  int ambiguous = 0;
  int wrong = 0;
  double plain_m = 0.0, corrected_m = 0.0;  ///< sums of the end's error
  double nees = 0.0;                        ///< likewise
};

void judge(const Scenario& scenario, const Simulation& run, const TimeSpan& span, int wheel, bool sideways,
           SteeredTally& tally) {
  const AlignedReadings readings = align(run.recording, scenario.nominal);
  const SlipReport report = find_slip(readings, {}, scenario.nominal, {.probability = 1e-3});
  const Vector2 end = run.truth.body.poses.back().pose.translation();
  ++tally.runs;
  tally.corrected_m += (report.end.translation() - end).norm();
  tally.plain_m += (integrate(readings, scenario.nominal).end.pose.translation() - end).norm();
  tally.nees += nees_at_end(corrected(readings, report, scenario.nominal), scenario.nominal, run.truth.body);
  bool found = false;
  for (const SlipEvent& event : report.events) {
    if (event.start_s >= span.end_s() || span.start_s >= event.end_s) continue;
    found = true;
    if (event.wheel == kAmbiguous)
      ++tally.ambiguous;
    else if (event.wheel != wheel)
      ++tally.wrong;
    else if (event.kind == SlipKind::unknown)
      ++tally.kind_open;
    else
      ++((event.kind == SlipKind::sideways) == sideways ? tally.right : tally.wrong);
  }
  tally.found += found ? 1 : 0;
}

/// Six seconds of one motion, in which a wheel spins by 1.3 to 2 for up to a second, or is misread by 6 to
/// 15°.
SteeredTally tally_of(const SteeredCase& robot, bool sideways, bool curved) {
  SteeredTally tally;
  Random random(11);
  const int runs = test::trials(300, 30);
  for (int i = 0; i < runs; ++i) {
    Scenario scenario = drive_of(robot, random.bits(), 0.0);
    const Twist2 velocity{random.uniform(0.2, 0.4), robot.sideways ? random.uniform(-0.3, 0.3) : 0.0,
                          curved ? (random.below(2) == 0 ? 1.0 : -1.0) * random.uniform(0.2, 0.4) : 0.0};
    scenario.path = {{Twist2::from(6.0 * velocity.vector()), 6.0}};
    const TimeSpan span{random.uniform(2.5, 4.0), random.uniform(0.5, 1.0)};
    std::vector<int> steered;
    for (int w = 0; w < robot.chassis.wheel_count; ++w)
      if (robot.chassis.wheels()[static_cast<std::size_t>(w)].steering) steered.push_back(w);
    const int wheel = steered[random.below(steered.size())];
    const double misread = (random.below(2) == 0 ? 1.0 : -1.0) * random.uniform(radians(6), radians(15));
    if (!sideways) scenario.slips = {{.wheel = wheel, .span = span, .factor = random.uniform(1.3, 2.0)}};
    Simulation run = simulate(scenario);
    WheelStream& wheels = run.recording.wheels;
    const std::string& name = scenario.nominal.wheel_names[static_cast<std::size_t>(wheel)];
    WheelSeries& steering = *std::ranges::find(wheels.steering, name, &WheelSeries::wheel);
    for (std::size_t k = 0; sideways && k < wheels.time_s.size(); ++k)
      if (wheels.time_s[k] >= span.start_s && wheels.time_s[k] <= span.end_s()) steering.value[k] += misread;
    judge(scenario, run, span, wheel, sideways, tally);
  }
  fmt::print(
      "  {:<20} {:<10} {} of {} found; of their events right {}, kind open {}, ambiguous {}, wrong {}; end "
      "off by {:.4f} m, "
      "corrected {:.4f} m, NEES {:.2f}\n",
      robot.name, sideways ? "misread" : "slips", tally.found, tally.runs, tally.right, tally.kind_open,
      tally.ambiguous, tally.wrong, tally.plain_m / runs, tally.corrected_m / runs, tally.nees / runs);
  return tally;
}

/// χ² of three numbers: its mean is 3 with variance 6 where the covariance is consistent.
void expect_corrected(const SteeredTally& tally) {
  EXPECT_GE(tally.found, 0.99 * tally.runs);
  EXPECT_LT(tally.corrected_m, 0.5 * tally.plain_m);
  EXPECT_LT(tally.nees / tally.runs, 3.0 + 4.0 * std::sqrt(6.0 / tally.runs));
}

void expect_named(const SteeredTally& tally) {
  const int events = tally.right + tally.kind_open + tally.ambiguous + tally.wrong;
  expect_corrected(tally);
  EXPECT_GE(tally.right, 0.97 * events);
  EXPECT_LE(tally.wrong, 0.01 * events);
}

TEST(SteeredAttribution, AModuleOfASwerveThatSlips) {
  for (const SteeredCase& robot : {kSwerve, kSwerveWithGyro}) expect_named(tally_of(robot, false, true));
}

TEST(SteeredAttribution, AModuleOfASwerveThatIsMisread) {
  for (const SteeredCase& robot : {kSwerve, kSwerveWithGyro}) expect_named(tally_of(robot, true, true));
}

TEST(SteeredAttribution, AFrontWheelOfACarWithFourEncoders) {
  expect_named(tally_of(kCar, false, true));
  expect_named(tally_of(kCar, true, true));
}

// One redundant reading: front wheel and gyro turn the robot differently. Travel or angle? By the wheel's
// recent travel alone, and a kind that is named is wrong as often as its probability says: at most one in
// ten.
TEST(SteeredAttribution, OfATricycleTheKindIsOpenWhereTheWheelsTravelDoesNotShowIt) {
  const SteeredTally slips = tally_of(kTricycleWithGyro, false, true);
  const SteeredTally misread = tally_of(kTricycleWithGyro, true, true);
  for (const SteeredTally& tally : {slips, misread}) {
    const double events = tally.right + tally.kind_open + tally.wrong;
    EXPECT_GE(tally.found, 0.99 * tally.runs);
    EXPECT_EQ(tally.ambiguous, 0);
    EXPECT_LE(tally.wrong, 0.1 * events + 4.0 * std::sqrt(0.09 * events));
    EXPECT_LT(tally.nees / tally.runs, 3.0 + 4.0 * std::sqrt(6.0 / tally.runs));
  }
  EXPECT_GT(misread.kind_open, 0);
}

// --- what lasts

/// The robot of the file drives with a steering of one wheel whose zero is off.
Scenario misaligned_drive(std::uint64_t seed, double zero_rad) {
  Scenario scenario = drive_of(kSwerve, seed, 60.0);
  scenario.truth.chassis.wheels()[1].steering->zero_rad = zero_rad;
  return scenario;
}

// 0.4° are less than 1σ of a reading, and 1.8σ of an interval's mean of five: no single interval shows them.
TEST(SteeredAttribution, ASmallErrorOfAZeroShowsInTheCumulativeSumsOfItsWheel) {
  int named = 0, open = 0, others = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Scenario scenario = misaligned_drive(seed, radians(0.4));
    const SlipReport report = find_slip(align(simulate(scenario).recording, scenario.nominal), {},
                                        scenario.nominal, {.probability = 1e-4});
    for (const SlipEvent& event : report.events)
      ++(event.wheel == kAmbiguous                              ? open
         : event.wheel == 1 && event.kind == SlipKind::sideways ? named
                                                                : others);
  }
  fmt::print("  a zero that is off by 0.4°: named {} times, ambiguous {}, others {}\n", named, open, others);
  EXPECT_GE(named, 10);
  EXPECT_LE(others, 0.1 * named + 4.0 * std::sqrt(0.1 * named));  // a wheel is named from 0.9 on
}

// A wrong zero is linear in the motion, eq. 12: clean driving teaches it.
TEST(SteeredLearning, AWrongZeroIsLearnedAndIsNoSlipAnyMore) {
  constexpr double kZero_rad = radians(2), kP = 0.01;
  const Scenario clean = misaligned_drive(21, kZero_rad);
  const auto intervals =
      clean_intervals(align(simulate(clean).recording, clean.nominal), clean.nominal, 0.25);
  const LearnedResiduals learned = learn_residuals(intervals, clean.nominal, {.probability = kP});
  SlipCounts taught, untaught;
  for (std::uint64_t seed = 31; seed <= 40; ++seed) {
    const Scenario scenario = misaligned_drive(seed, kZero_rad);
    const AlignedReadings readings = align(simulate(scenario).recording, scenario.nominal);
    const auto add = [&](SlipCounts& sum, const SlipOptions& options) {
      const SlipCounts counts = find_slip(readings, {}, scenario.nominal, options).counts;
      sum.judged += counts.judged;
      sum.alarms += counts.alarms;
    };
    add(taught, {.probability = kP, .model = learned.model});
    add(untaught, {.probability = kP});
  }
  const auto judged = static_cast<double>(taught.judged);
  fmt::print("  a zero that is off by 2°: {} alarms of {}, learned {}\n", untaught.alarms, taught.judged,
             taught.alarms);
  // Beyond the k-th largest of n values lies a share of about χ²_2k/2n.
  const auto n = static_cast<double>(intervals.size());
  const double share = chi_squared_limit(1e-3, 2.0 * std::ceil(kP * n)) / (2.0 * n);
  EXPECT_LE(static_cast<double>(taught.alarms), share * judged + 4.0 * std::sqrt(share * judged));
  EXPECT_GT(untaught.alarms, 10 * taught.alarms);
}

}  // namespace
}  // namespace trundle::slip
