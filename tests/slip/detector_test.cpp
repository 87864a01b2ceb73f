// What the detector says of single situations: parked, stuck, without gyro, one event or two.
#include "trundle/slip/detector.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/slip/find_slip.hpp"

#include "chassis/robots.hpp"
#include "slip/noisy_robots.hpp"

namespace trundle::slip {
namespace {

using test::noisy_differential;

constexpr double kStep_s = 0.25;

/// Driven wheels 0 and 1, pods 2 to 4.
Robot with_pods() {
  Robot robot = test::robot_of(test::joined(differential_drive(test::kSize, 0.4), test::three_pods()));
  robot.chassis.noise.wheel_per_sqrt_m = 0.001;
  return robot;
}

/// Feeds a detector with motions and excesses of single wheels.
class FedDetector {
 public:
  FedDetector(const Robot& robot, const SlipOptions& options) : robot_(robot), detector_(robot, options) {}

  SlipVerdict step(const Twist2& motion, std::size_t wheel = 0, double excess_m = 0.0) {
    Increment increment = test::increment_of(robot_.chassis, motion, kStep_s);
    increment.turned[wheel] += excess_m / (kPi * robot_.chassis.wheels()[wheel].diameter_m);
    return step(increment);
  }
  SlipVerdict step(Increment increment) {
    increment.time_s = clock_ += kStep_s;
    return take(detector_.step({increment, {}}));
  }
  std::vector<SlipEvent> events() {
    take(detector_.finish());
    return events_;
  }

 private:
  SlipVerdict take(const SlipVerdict& verdict) {
    events_.insert(events_.end(), verdict.ended.begin(),
                   verdict.ended.begin() + static_cast<std::ptrdiff_t>(verdict.ended_count));
    return verdict;
  }

  Robot robot_;
  SlipDetector detector_;
  double clock_ = 0.0;
  std::vector<SlipEvent> events_;
};

const Twist2 kForward{0.06, 0.0, 0.0};
const Twist2 kBackward{-0.06, 0.0, 0.0};

// A slip begins within an interval that does not alarm yet: its wheel jumps there, but the robot has not
// taken another speed.
TEST(Detector, ASlipThatBeginsWithinAnIntervalIsStillToldByTheMotionBeforeIt) {
  Robot robot = noisy_differential();
  robot.chassis.noise.wheel_per_sqrt_m = 0.02;
  FedDetector drive(robot, {.probability = 1e-4});
  for (int i = 0; i < 10; ++i) drive.step(kForward);
  EXPECT_FALSE(drive.step(kForward, 1, 0.028).slipping);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(drive.step(kForward, 1, 0.06).slipping);
  for (int i = 0; i < 5; ++i) drive.step(kForward);
  const std::vector<SlipEvent> events = drive.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].wheel, 1);
  EXPECT_EQ(events[0].kind, SlipKind::spin);
  EXPECT_NEAR(events[0].excess_m, 0.028 + 3 * 0.06, 1e-9);  // what the first interval lost counts too
  EXPECT_GT(events[0].excess_sigma_m, 0.01);
}

void expect_one_event(const Twist2& motion, std::size_t wheel, double excess_m, SlipKind kind,
                      SlipMethod method) {
  FedDetector drive(noisy_differential(), {.method = method});
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(drive.step(motion).slipping);
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(drive.step(motion, wheel, excess_m).slipping);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(drive.step(motion).slipping);
  const std::vector<SlipEvent> events = drive.events();
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].wheel, static_cast<int>(wheel));
  EXPECT_EQ(events[0].kind, kind);
  EXPECT_NEAR(events[0].start_s, 2.5, 1e-9);
  EXPECT_NEAR(events[0].end_s, 3.25, 1e-9);
  EXPECT_NEAR(events[0].excess_m, 3 * excess_m, 1e-9);
  EXPECT_GT(events[0].confidence, 0.99);
}

TEST(Detector, SpinAndSkidForwardsAndBackwardsOfEitherWheel) {
  for (const std::size_t wheel : {0, 1}) {
    expect_one_event(kForward, wheel, 0.02, SlipKind::spin, SlipMethod::general);
    expect_one_event(kForward, wheel, -0.018, SlipKind::skid, SlipMethod::general);
    expect_one_event(kBackward, wheel, -0.02, SlipKind::spin, SlipMethod::general);
    expect_one_event(kBackward, wheel, 0.018, SlipKind::skid, SlipMethod::general);
  }
}

// Source 2's rule: the sign of δ names the wheel that spins.
TEST(Detector, ThePublishedRuleNamesTheWheelThatSpins) {
  for (const std::size_t wheel : {0, 1}) {
    expect_one_event(kForward, wheel, 0.02, SlipKind::spin, SlipMethod::published);
    expect_one_event(kBackward, wheel, -0.02, SlipKind::spin, SlipMethod::published);
    // Its assumption: where one wheel skids, the other one would have spun.
    FedDetector skid(noisy_differential(), {.method = SlipMethod::published});
    EXPECT_EQ(skid.step(kForward, wheel, -0.018).wheel, static_cast<int>(1 - wheel));
  }
}

// Without a pause between them: a slip is that of one wheel.
TEST(Detector, TheOtherWheelsSlipIsAnother) {
  for (const SlipMethod method : {SlipMethod::general, SlipMethod::published}) {
    FedDetector drive(noisy_differential(), {.method = method});
    for (int i = 0; i < 10; ++i) drive.step(kForward);
    for (const std::size_t wheel : {0, 1, 0})
      for (int i = 0; i < 3; ++i) EXPECT_EQ(drive.step(kForward, wheel, 0.02).wheel, static_cast<int>(wheel));
    const std::vector<SlipEvent> events = drive.events();
    ASSERT_EQ(events.size(), 3U);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(events[k].wheel, k == 1 ? 1 : 0);
      EXPECT_NEAR(events[k].excess_m, 0.06, 1e-9);
    }
  }
}

TEST(Detector, ALockedWheelSkids) {
  expect_one_event(kForward, 0, -kForward.dx, SlipKind::skid, SlipMethod::general);
}

SlipEvent first_event(const Twist2& motion, double slip_m, double spin_odds) {
  FedDetector drive(noisy_differential(), {.spin_odds = spin_odds});
  drive.step(motion, 0, slip_m);
  drive.step(motion);
  const std::vector<SlipEvent> events = drive.events();
  EXPECT_EQ(events.size(), 1U);
  return events.at(0);
}

TEST(Detector, WithoutMotionBeforeItIsAmbiguousWhereNeitherKindIsLikelier) {
  const SlipEvent event = first_event(kForward, 0.02, 1.0);
  EXPECT_EQ(event.wheel, kAmbiguous);
  EXPECT_EQ(event.kind, SlipKind::unknown);
  EXPECT_NEAR(event.confidence, 0.5, 1e-9);
}

TEST(Detector, WithoutMotionBeforeTheOddsOfSpinDecide) {
  for (const double direction : {1.0, -1.0}) {
    const SlipEvent event = first_event({direction * kForward.dx, 0.0, 0.0}, direction * 0.03, 10.0);
    EXPECT_EQ(event.wheel, 0);
    EXPECT_EQ(event.kind, SlipKind::spin);
    EXPECT_NEAR(event.confidence, 10.0 / 11.0, 1e-4);
  }
}

// So small an error may as well be that of a wheel's radius, and that errs to either side.
TEST(Detector, TheOddsOfSpinSayNothingOfWhatARadiusExplains) {
  const SlipEvent event = first_event(kForward, 0.004, 10.0);
  EXPECT_EQ(event.wheel, kAmbiguous);
  EXPECT_LT(event.confidence, 0.6);
}

TEST(Detector, WhileTheCommandSlowsDownAWheelSkids) {
  for (const bool slows : {true, false}) {
    SlipDetector detector(noisy_differential(), {});
    Increment increment = test::increment_of(noisy_differential().chassis, kForward, kStep_s);
    increment.turned[0] -= 0.03 / (kPi * noisy_differential().chassis.wheels()[0].diameter_m);
    increment.time_s = kStep_s;
    EXPECT_EQ(detector.step({increment, {}}, {.changed = true, .slows = slows}).wheel, slows ? 0 : 1);
  }
}

TEST(Detector, TheWheelThatSlipsCountsForLittle) {
  FedDetector drive(noisy_differential(), {});
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(drive.step(kForward).correction.none());
  const SlipVerdict verdict = drive.step(kForward, 0, 0.02);
  EXPECT_EQ(verdict.wheel, 0);
  // What motion alone says is no surer than B of eq. 9a: (√(2π)/200)², for τ is below 1 % of the travel.
  const double unlikely = 2.0 * kPi / (200.0 * 200.0);
  EXPECT_NEAR(verdict.correction.variance[0], 0.02 * 0.02, unlikely * 0.02 * 0.02);
  EXPECT_GT(verdict.correction.variance[1], 0.0);
  EXPECT_LT(verdict.correction.variance[1], unlikely * 0.02 * 0.02);
}

TEST(Detector, SmallSlipThatPersistsIsFoundByItsSum) {
  FedDetector drive(noisy_differential(), {.probability = 1e-3});
  bool slipped = false;
  int alarms = 0;
  for (int i = 0; i < 10; ++i) drive.step(kForward);
  for (int i = 0; i < 30; ++i) {
    const SlipVerdict verdict = drive.step(kForward, 1, 0.0006);
    slipped = slipped || verdict.slipping;
    alarms += verdict.alarm ? 1 : 0;
  }
  EXPECT_EQ(alarms, 0);
  EXPECT_TRUE(slipped);
}

TEST(Detector, AnUncertainBiasIsNoPersistentSlip) {
  SlipDetector detector(noisy_differential(), {});
  const GyroBias wrong{.rad_s = 0.003, .variance = 0.003 * 0.003};
  for (int i = 0; i < 200; ++i) {
    Increment increment = test::increment_of(noisy_differential().chassis, kForward, kStep_s);
    increment.time_s = kStep_s * i;
    EXPECT_FALSE(detector.step({increment, wrong}).slipping);
  }
}

TEST(Detector, ParkedIsNotStuck) {
  FedDetector drive(with_pods(), {});
  for (int i = 0; i < 10; ++i) EXPECT_EQ(drive.step(Twist2{}).status, SlipStatus::parked);
  EXPECT_TRUE(drive.events().empty());
}

TEST(Detector, StuckIsNotParked) {
  FedDetector drive(with_pods(), {});
  for (int i = 0; i < 10; ++i) drive.step(kForward);
  for (int i = 0; i < 4; ++i) {
    Increment spinning = test::increment_of(with_pods().chassis, kForward, kStep_s);
    for (std::size_t pod = 2; pod < 5; ++pod) spinning.turned[pod] = 0.0;
    const SlipVerdict verdict = drive.step(spinning);
    EXPECT_TRUE(verdict.slipping);
    EXPECT_GT(verdict.correction.variance[0], 1e-3);
    EXPECT_GT(verdict.correction.variance[1], 1e-3);
    EXPECT_EQ(verdict.correction.variance[2], 0.0);
  }
  const std::vector<SlipEvent> events = drive.events();
  ASSERT_EQ(events.size(), 2U);
  for (const SlipEvent& event : events) {
    EXPECT_EQ(event.kind, SlipKind::stuck);
    EXPECT_NEAR(event.excess_m, 4 * kForward.dx, 1e-9);
  }
}

TEST(Detector, TwoWheelsThatSlipAtOnceAreNotBlamedOnOne) {
  FedDetector drive(with_pods(), {});
  for (int i = 0; i < 10; ++i) drive.step(kForward);
  Increment both = test::increment_of(with_pods().chassis, kForward, kStep_s);
  for (const std::size_t wheel : {0, 1}) both.turned[wheel] *= 1.5;
  const SlipVerdict verdict = drive.step(both);
  EXPECT_TRUE(verdict.slipping);
  EXPECT_EQ(verdict.wheel, kAmbiguous);
}

TEST(Detector, AGapOfTheGyroEndsASlipAndIsNotJudged) {
  FedDetector drive(noisy_differential(), {});
  for (int i = 0; i < 10; ++i) drive.step(kForward);
  drive.step(kForward, 0, 0.02);
  Increment blind = test::increment_of(noisy_differential().chassis, kForward, kStep_s);
  blind.has_gyro = false;
  const SlipVerdict verdict = drive.step(blind);
  EXPECT_EQ(verdict.status, SlipStatus::no_gyro);
  EXPECT_EQ(verdict.ended_count, 1U);
  EXPECT_TRUE(verdict.correction.none());
}

TEST(Detector, ThePublishedMethodIsForNearlyStraightDriving) {
  FedDetector drive(noisy_differential(), {.method = SlipMethod::published});
  EXPECT_EQ(drive.step(Twist2{0.06, 0.0, 0.02}).status, SlipStatus::judged);  // |dL − dR| = 0.083 |dL + dR|
  EXPECT_EQ(drive.step(Twist2{0.06, 0.0, 0.05}).status, SlipStatus::not_applicable);  // 0.208
}

TEST(Detector, ABandHoldsOnlyWhereItWasLearned) {
  SlipOptions options{.method = SlipMethod::published};
  options.band.emplace();
  options.band->lower = -0.01;
  options.band->upper = 0.01;
  options.band->interval_s = kStep_s;
  options.band->least_speed_m_s = options.band->greatest_speed_m_s = 0.24;
  FedDetector drive(noisy_differential(), options);
  EXPECT_EQ(drive.step(kForward).status, SlipStatus::judged);
  EXPECT_EQ(drive.step(Twist2{0.12, 0.0, 0.0}).status, SlipStatus::not_learned);
  EXPECT_FALSE(drive.step(kForward, 0, -0.0049).alarm);
  EXPECT_TRUE(drive.step(kForward, 0, -0.0051).alarm);
}

TEST(Detector, PublishedCorrectionIsTheSourcesFormula) {
  const Chassis chassis = noisy_differential().chassis;
  const double g = 0.03;
  Increment increment = test::increment_of(chassis, {0.06, 0.0, g}, kStep_s);
  const double metres = kPi * test::kSize.diameter_m;
  increment.turned[0] += 0.02 / metres;
  SlipCorrection correction;
  correction.rebuilt_wheel = 0;
  correction.other_wheel = 1;
  correction.track_m = -0.5;  // left − right
  const double right = increment.turned[1] * metres;
  EXPECT_NEAR(corrected(increment, correction, chassis).turned[0] * metres, right - 0.5 * std::tan(g), 1e-12);
  // Clamped where the corrected travel would turn against the motion.
  increment.turned[1] = 0.01 / metres;
  EXPECT_EQ(corrected(increment, correction, chassis).turned[0], 0.0);
}

TEST(Detector, RefusesRobotsThatCannotShowSlip) {
  EXPECT_THROW(SlipDetector(test::robot_of(differential_drive(test::kSize, 0.5)), {}), CannotAnswer);
  EXPECT_THROW(SlipDetector(test::robot_of(test::velocity_robot()), {}), CannotAnswer);
  EXPECT_THROW(SlipDetector(with_pods(), {.method = SlipMethod::published}), CannotAnswer);
}

/// False alarms have a size, too; the sum of many must not grow with them.
TEST(LostTravel, IsNoSumOfWhatNoiseMakesOfIt) {
  std::vector<SlipEvent> events(100, SlipEvent{.excess_m = 0.001, .excess_sigma_m = 0.001});
  events.push_back({.excess_m = -0.09, .excess_sigma_m = 0.001});
  const LostTravel lost = lost_travel(events);
  EXPECT_NEAR(lost.m, 0.09, 1e-5);
  EXPECT_NEAR(lost.sigma_m, std::sqrt(101.0) * 0.001, 1e-12);
}

}  // namespace
}  // namespace trundle::slip
