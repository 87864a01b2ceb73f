// A gyro that is read late where it alone sees turns is named, and the reference is not blamed for it.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/inspection/findings.hpp"
#include "trundle/simulation/scenario.hpp"

#include "recording/findings.hpp"
#include "recording/robots.hpp"

namespace trundle::inspection {
using namespace simulation;
namespace {

using test::finding;
using testing::Contains;

/// With clocks so far off.
Robot pods(double gyro_s, double reference_s = 0.0) {
  return test::pods_and_gyro(2000.0, gyro_s, reference_s);
}

Findings found_in_tour(const Robot& truth, const Robot& nominal) {
  Random random(4, 99);
  Scenario scenario;
  scenario.nominal = nominal;
  scenario.truth = truth;
  scenario.path = joined(
      {pause(3.0), random_tour({.length_m = 20.0}, {}, random, {.forward_m_s = 0.6, .turn_rad_s = 0.8})});
  scenario.steering = Steering::truth;
  scenario.whole_intervals = false;
  scenario.encoders.rate_hz = 50.0;
  scenario.reference = {.rate_hz = 20.0, .position_sigma_m = 0.002, .heading_sigma_rad = 0.005};
  return find_in(simulate(scenario).recording, &nominal);
}

std::ptrdiff_t clocks_named(const Findings& findings) {
  return std::ranges::count_if(findings.problems, [](const Finding& problem) {
    return problem.code == FindingCode::time_offset || problem.code == FindingCode::reference_time_offset;
  });
}

TEST(GyroClockFinding, a_late_gyro_is_named_and_nothing_else) {
  const Findings findings = found_in_tour(pods(-0.06), pods(0.0));
  ASSERT_TRUE(findings.gyro_time_offset && findings.reference_time_offset);
  EXPECT_NEAR(findings.gyro_time_offset->offset_s, -0.06, 4.0 * findings.gyro_time_offset->sigma_s);
  EXPECT_NEAR(findings.reference_time_offset->offset_s, 0.0, 4.0 * findings.reference_time_offset->sigma_s);
  EXPECT_EQ(clocks_named(findings), 1);
  EXPECT_THAT(findings.problems, Contains(finding(FindingCode::time_offset, "too late")));
}

TEST(GyroClockFinding, a_reference_that_is_late_is_named_and_nothing_else) {
  const Findings findings = found_in_tour(pods(0.0, -0.2), pods(0.0));
  EXPECT_EQ(clocks_named(findings), 1);
  EXPECT_THAT(findings.problems, Contains(finding(FindingCode::reference_time_offset, "too late")));
}

TEST(GyroClockFinding, nothing_is_named_where_the_robot_file_has_it_right) {
  EXPECT_EQ(clocks_named(found_in_tour(pods(-0.06, 0.1), pods(-0.06, 0.1))), 0);
}

}  // namespace
}  // namespace trundle::inspection
