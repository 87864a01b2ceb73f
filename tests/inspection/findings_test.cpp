#include "trundle/inspection/findings.hpp"

#include <gmock/gmock.h>

#include "trundle/simulation/scenario.hpp"

#include "recording/robots.hpp"

namespace trundle {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

Robot robot_with_gyro(double time_offset_s) {
  return test::with_gyro(test::two_wheels(), {.noise_rad_s_sqrt_hz = 3e-4, .time_offset_s = time_offset_s});
}

Recording tour(const Robot& truth) {
  Scenario scenario;
  scenario.nominal = scenario.truth = truth;
  Random random(1, 99);
  scenario.path = random_tour({.length_m = 15.0}, {}, random);
  scenario.steering = Steering::truth;
  scenario.seed = 1;
  return simulate(scenario).recording;
}

TEST(Findings, a_gyro_whose_stamps_are_late_is_found_and_named) {
  const Recording recording = tour(robot_with_gyro(-0.04));
  const Robot robot = robot_with_gyro(0.0);
  const Findings findings = find_in(recording, &robot);
  EXPECT_TRUE(findings.compares_clocks);
  ASSERT_TRUE(findings.gyro_time_offset);
  EXPECT_NEAR(findings.gyro_time_offset->offset_s, -0.04, 4.0 * findings.gyro_time_offset->sigma_s);
  EXPECT_THAT(findings.problems, Contains(AllOf(Field(&Problem::kind, "time offset"),
                                                Field(&Problem::message, HasSubstr("too late")))));
  const Robot told = robot_with_gyro(-0.04);
  EXPECT_THAT(find_in(recording, &told).problems, Not(Contains(Field(&Problem::kind, "time offset"))));
}

TEST(Findings, what_no_sensor_on_board_can_see_is_said) {
  const Robot robot = robot_with_gyro(0.0);
  const Findings findings = find_in(tour(robot), &robot);
  ASSERT_TRUE(findings.abilities);
  EXPECT_THAT(findings.abilities->cannot, Contains(HasSubstr("all wheels slipping together")));
}

TEST(Findings, the_track_on_the_ground_where_wheels_scrub) {
  Robot robot;
  robot.name = "skid-steer";
  robot.chassis = skid_steer({.diameter_m = 0.2, .ticks_per_revolution = 4000.0}, 0.9, 0.4);
  robot.chassis.gyro = Gyro{};
  robot.wheel_names = {"fl", "fr", "rl", "rr"};
  const Findings findings = find_in(tour(robot), &robot);
  ASSERT_THAT(findings.tracks, Not(IsEmpty()));
  EXPECT_NEAR(findings.tracks.front().track_m, 0.9, 4.0 * findings.tracks.front().sigma_m);
}

TEST(Findings, a_recording_that_does_not_suit_the_robot_says_what_is_missing) {
  Robot robot = robot_with_gyro(0.0);
  const Recording recording = tour(robot);
  robot.wheel_names = {"front", "rear"};
  const Findings findings = find_in(recording, &robot);
  EXPECT_THAT(findings.missing, Contains(HasSubstr("the wheel 'front'")));
  EXPECT_FALSE(findings.gyro_time_offset);
}

TEST(Findings, without_a_robot_nothing_is_compared) {
  const Findings findings = find_in(tour(robot_with_gyro(-0.04)));
  EXPECT_FALSE(findings.abilities);
  EXPECT_FALSE(findings.compares_clocks);
  EXPECT_THAT(findings.streams, Contains(Field(&StreamSummary::stream, "gyro")));
}

}  // namespace
}  // namespace trundle
