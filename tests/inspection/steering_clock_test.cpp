// A steering that is read late is named, and no other clock is blamed for it.
#include <algorithm>
#include <array>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/inspection/findings.hpp"
#include "trundle/simulation/scenario.hpp"

#include "recording/findings.hpp"
#include "scale.hpp"

namespace trundle::inspection {
using namespace simulation;
namespace {

using test::finding;
using testing::Contains;
using testing::Field;
using testing::Not;

Robot forklift(double steering_s, double gyro_s) {
  Robot robot;
  robot.name = "forklift";
  robot.chassis = tricycle({0.2, 1000.0, 16}, 0.4, {.sigma_rad = 0.002, .time_offset_s = steering_s});
  robot.wheel_names = {"front"};
  robot.passive_names = {"rear"};
  robot.chassis.gyro = Gyro{.bias_rad_s = 0.01, .time_offset_s = gyro_s};
  robot.chassis.noise.wheel_per_sqrt_m = 0.002;
  return robot;
}

/// With a reference, whose clock is right.
Recording drive_of(const Robot& truth, const Path& path, double rate_hz, std::uint64_t seed) {
  Scenario scenario;
  scenario.nominal = scenario.truth = truth;
  scenario.path = path;
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = rate_hz;
  scenario.reference = {.rate_hz = 5.0, .position_sigma_m = 0.001, .heading_sigma_rad = 0.002};
  scenario.seed = seed;
  return simulate(scenario).recording;
}

Path tour_of(std::uint64_t seed) {
  Random random(seed, 99);
  return joined(
      {pause(3.0), random_tour({.length_m = 20.0}, {}, random, {.forward_m_s = 0.6, .turn_rad_s = 0.8})});
}

bool is_of_a_clock(const Finding& problem) {
  return problem.code == FindingCode::time_offset || problem.code == FindingCode::steering_time_offset ||
         problem.code == FindingCode::reference_time_offset;
}

TEST(SteeringClockFinding, a_late_steering_is_named_and_nothing_else) {
  const Robot robot = forklift(0.0, 0.0);
  const Findings findings = find_in(drive_of(forklift(-0.2, 0.0), tour_of(1), 20.0, 1), &robot);
  ASSERT_TRUE(findings.steering_time_offset);
  EXPECT_NEAR(findings.steering_time_offset->offset_s, -0.2, 4.0 * findings.steering_time_offset->sigma_s);
  EXPECT_EQ(std::ranges::count_if(findings.problems, is_of_a_clock), 1);
  EXPECT_THAT(findings.problems, Contains(finding(FindingCode::steering_time_offset,
                                                  "ms too late in front_steering_rad, by turns that")));
  EXPECT_THAT(findings.problems,
              Contains(finding(FindingCode::steering_time_offset, "write steering_time_offset_s = -0.")));
  const Robot told = forklift(-0.2, 0.0);
  EXPECT_TRUE(
      std::ranges::none_of(find_in(drive_of(told, tour_of(1), 20.0, 1), &told).problems, is_of_a_clock));
}

TEST(SteeringClockFinding, both_clocks_are_named_where_both_are_off) {
  const Robot robot = forklift(0.0, 0.0);
  const Findings findings = find_in(drive_of(forklift(-0.1, 0.06), tour_of(2), 20.0, 2), &robot);
  EXPECT_EQ(std::ranges::count_if(findings.problems, is_of_a_clock), 2);
  EXPECT_THAT(findings.problems, Contains(finding(FindingCode::steering_time_offset, "too late")));
  EXPECT_THAT(findings.problems, Contains(finding(FindingCode::time_offset, "too early")));
}

TEST(SteeringClockFinding, nothing_is_named_where_no_clock_is_off) {
  const Robot robot = forklift(0.0, 0.0);
  for (const double rate_hz : {10.0, 20.0, 50.0, 100.0})
    for (int i = 0; i < test::trials(40, 2); ++i) {
      const auto seed = static_cast<std::uint64_t>(i + 1);
      const Findings findings = find_in(drive_of(robot, tour_of(seed), rate_hz, seed), &robot);
      EXPECT_TRUE(findings.steering_time_offset);
      EXPECT_TRUE(std::ranges::none_of(findings.problems, is_of_a_clock)) << rate_hz << " Hz, " << seed;
    }
}

TEST(SteeringClockFinding, at_one_speed_neither_clock_is_blamed) {
  Path path;
  for (int i = 0; i < 40; ++i) {
    const double curvature_1_m = (i % 2 == 0 ? 1.0 : -1.0) * (0.4 + 0.3 * std::sin(1.7 * i));
    path.push_back({{0.9, 0.0, 0.9 * curvature_1_m}, 1.5});
  }
  const Robot robot = forklift(0.0, 0.0);
  Recording recording = drive_of(forklift(-0.15, 0.0), path, 20.0, 3);
  recording.reference = {};
  const Findings findings = find_in(recording, &robot);
  EXPECT_FALSE(findings.steering_time_offset);
  EXPECT_THAT(findings.problems,
              Contains(finding(FindingCode::steering_time_offset, "does not tell which of them is wrong")));
  EXPECT_THAT(findings.problems, Not(Contains(Field(&Finding::code, FindingCode::time_offset))));
}

}  // namespace
}  // namespace trundle::inspection
