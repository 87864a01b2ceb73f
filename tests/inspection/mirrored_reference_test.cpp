#include "trundle/inspection/mirrored_reference.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>

#include "trundle/inspection/findings.hpp"
#include "trundle/simulation/scenario.hpp"
#include "trundle/statistics/random.hpp"

#include "recording/findings.hpp"
#include "recording/robots.hpp"

namespace trundle::inspection {
namespace {

/// Figures of eight, the first half of them backwards, measured to 2 mm and 0.01 rad.
ReferenceStream eights() {
  ReferenceStream reference;
  Random random(1, 1);
  Pose2 pose;
  for (int k = 0; k < 4000; ++k) {
    const double time_s = 0.02 * k;
    const double forward_m = k < 2000 ? -0.01 : 0.01;
    pose = pose * exp(Twist2{forward_m, 0.0, 0.02 * std::cos(0.3 * time_s)});
    reference.time_s.push_back(time_s);
    reference.x_m.push_back(pose.x + random.normal(0.002));
    reference.y_m.push_back(pose.y + random.normal(0.002));
    reference.heading_rad.push_back(pose.heading + random.normal(0.01));
  }
  return reference;
}

TEST(MirroredReference, IsKnownByHowItBends) {
  ReferenceStream reference = eights();
  EXPECT_FALSE(is_mirrored(reference));
  std::swap(reference.x_m, reference.y_m);
  EXPECT_TRUE(is_mirrored(reference));
  for (double& y : reference.y_m) y = -y;  // turned by a quarter: no mirror any more
  EXPECT_FALSE(is_mirrored(reference));
}

TEST(MirroredReference, SaysNothingWhereNothingBends) {
  ReferenceStream straight = eights();
  std::ranges::fill(straight.y_m, 0.0);
  EXPECT_FALSE(is_mirrored(straight));
  ReferenceStream without_headings = eights();
  std::swap(without_headings.x_m, without_headings.y_m);
  std::ranges::fill(without_headings.heading_rad, std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(is_mirrored(without_headings));
}

TEST(MirroredReference, IsNamedForRobotsThatRollWhereTheyLook) {
  const auto is_named = testing::Contains(testing::Field(&Finding::code, FindingCode::reference_axes));
  Recording recording;
  recording.reference = eights();
  recording.wheels.time_s = recording.reference.time_s;
  for (const char* name : {"left", "right"})
    recording.wheels.series.push_back(
        {name, WheelUnit::ticks, std::vector<double>(recording.wheels.time_s.size(), 0.0)});
  const Robot robot = test::two_wheels();
  EXPECT_THAT(find_in(recording, &robot).problems, testing::Not(is_named));
  std::swap(recording.reference.x_m, recording.reference.y_m);
  EXPECT_THAT(find_in(recording, &robot).problems, is_named);
}

/// Path and headings fit each other then, and a robot with all wheels mirrored would fit both.
TEST(MirroredReference, IsNamedWhereWheelsAndGyroAgreeAgainstIt) {
  const auto is_named =
      testing::Contains(test::finding(FindingCode::reference_axes, "the other way than wheels and gyro"));
  const Robot robot = test::with_gyro(test::two_wheels());
  Scenario scenario;
  scenario.nominal = scenario.truth = robot;
  Random random(1, 99);
  scenario.path = random_tour({.length_m = 15.0}, {}, random);
  scenario.reference.rate_hz = 10.0;
  Recording recording = simulate(scenario).recording;
  EXPECT_THAT(find_in(recording, &robot).problems, testing::Not(is_named));
  for (double& y : recording.reference.y_m) y = -y;
  for (double& heading : recording.reference.heading_rad) heading = -heading;
  EXPECT_THAT(find_in(recording, &robot).problems, is_named);
}

}  // namespace
}  // namespace trundle::inspection
