// Markers are stuck where there is room for them. What a marker beside the robot's middle shows is no noise
// of the wheels, and nobody has to measure where it is.
#include <cmath>
#include <cstdio>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/gyro_bias_oracle.hpp"
#include "calibration/stated_errors.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test::drifting_gyro;
using testing::Contains;
using testing::HasSubstr;

constexpr Pose2 kMarker{-0.03, 0.012, 0.03};

Machine marked_machine() {
  Machine machine = differential_machine();
  machine.truth.body_from_reference = kMarker;
  return machine;
}

/// What the reference says of the middle, said of the marker.
std::vector<Recording> seen_by_marker(std::vector<Recording> recordings, bool headings) {
  for (Recording& recording : recordings) {
    ReferenceStream& seen = recording.reference;
    for (std::size_t i = 0; i < seen.time_s.size(); ++i) {
      const Pose2 marker = Pose2{seen.x_m[i], seen.y_m[i], seen.heading_rad[i]} * kMarker;
      seen.x_m[i] = marker.x;
      seen.y_m[i] = marker.y;
      seen.heading_rad[i] = headings ? marker.heading : kNotMeasured;
    }
  }
  return recordings;
}

std::vector<Recording> marked_runs(const Machine& machine, bool headings, int trial) {
  const Conditions conditions{.duration_s = 60.0, .runs = 2};
  return seen_by_marker(driven(machine, conditions, static_cast<std::uint64_t>(trial)).recordings, headings);
}

TEST(MarkerBesideTheMiddle, IsFoundByItself) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  constexpr double kChance = 1e-3;
  const Machine machine = marked_machine();
  const int trials = test::trials(8, 2);
  for (const bool headings : {true, false}) {
    double nees = 0.0, degrees = 0.0;
    for (int trial = 0; trial < trials; ++trial) {
      const CalibrationResult result = calibrate(marked_runs(machine, headings, trial), {}, machine.nominal);
      EXPECT_THAT(result.notes, Contains(HasSubstr("which does not say: it is estimated")));
      const test::StatedErrors stated = test::stated_errors(result, machine.truth);
      EXPECT_EQ(stated.error.size(), headings ? 7 : 6)
          << "two diameters, track, scale, and the marker's place";
      nees += stated.nees();
      degrees += stated.expected_nees();
    }
    std::printf("marker, %s: NEES %.2f of each degree of freedom\n", headings ? "poses" : "positions",
                nees / degrees);
    EXPECT_LT(nees, statistics::chi_squared_limit(kChance, degrees));
    EXPECT_GT(nees, statistics::chi_squared_limit(1.0 - kChance, degrees));
  }
}

// Wheels came out 15 to 33 % too large, and were stated to a hundredth of that.
TEST(MarkerBesideTheMiddle, MakesNoWheelLargerWhereItIsSaidToBeElsewhere) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Machine machine = marked_machine();
  Robot misplaced = machine.nominal;
  misplaced.body_from_reference.x = -0.015;
  const std::vector<Recording> runs = marked_runs(machine, true, 1);
  for (const CalibrationResult& result :
       {calibrate(runs, {}, misplaced), calibrate(runs, {}, machine.nominal, {.fix = {"reference.x"}})}) {
    EXPECT_THAT(result.warnings, Contains(HasSubstr("the references fit better with their sensor")));
    for (const ParameterEstimate& e : result.parameters) {
      if (e.parameter == kGyroBias) continue;
      const double off = e.value - value_of(e.parameter, machine.truth);
      std::printf("%s off by %.2e, %.2f sigmas\n", e.name.c_str(), off, off / e.sigma_total);
      EXPECT_LT(std::abs(off), 4.0 * e.sigma_total) << e.name;
      if (e.parameter.kind == ParameterKind::diameter) {
        EXPECT_LT(std::abs(off), 0.03 * e.nominal) << e.name;
      }
    }
  }
}

TEST(MarkerBesideTheMiddle, IsNotSoughtWhereItIsInTheMiddle) {
  const Machine machine = differential_machine();
  for (int trial = 0; trial < 3; ++trial) {
    const auto runs =
        driven(machine, {.duration_s = 60.0, .runs = 2}, static_cast<std::uint64_t>(trial)).recordings;
    for (const ParameterEstimate& e : calibrate(runs, {}, machine.nominal).parameters)
      EXPECT_FALSE(e.name.starts_with("reference.")) << e.name;
  }
}

}  // namespace
}  // namespace trundle::calibration
