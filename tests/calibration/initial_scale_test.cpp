// A robot file may be wrong by a gear or by the ticks of a revolution: the fit must not end in another
// minimum.
#include "trundle/calibration/preparation/initial_scale.hpp"

#include <algorithm>

#include <gmock/gmock.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/io/error.hpp"

#include "calibration/simulated_runs.hpp"

namespace trundle::calibration {
namespace {

using testing::Contains;
using testing::HasSubstr;

class WheelsOfWrongSize : public testing::TestWithParam<double> {};

TEST_P(WheelsOfWrongSize, AreFoundAllTheSameAndToldOf) {
  const Robot right = test::nominal_differential();
  const std::vector<Recording> runs =
      test::recorded(right, test::true_differential(), test::differential_paths(), 1);
  Robot wrong = right;
  scale_wheels(GetParam(), wrong);

  const CalibrationResult expected = calibrate(runs, {}, right, {});
  const CalibrationResult found = calibrate(runs, {}, wrong, {});

  ASSERT_EQ(found.parameters.size(), expected.parameters.size());
  for (std::size_t j = 0; j < found.parameters.size(); ++j)
    EXPECT_NEAR(found.parameters[j].value, expected.parameters[j].value,
                0.2 * expected.parameters[j].sigma_within)
        << found.parameters[j].name;
  EXPECT_THAT(found.warnings, Contains(HasSubstr("ticks_per_revolution")));
  EXPECT_THAT(expected.warnings, testing::Not(Contains(HasSubstr("ticks_per_revolution"))));
}

INSTANTIATE_TEST_SUITE_P(By, WheelsOfWrongSize, testing::Values(0.1, 0.5, 0.7, 1.4, 2.0, 40.0));

/// Wheels of 100 m are no answer, whatever the fit says.
TEST(ReferenceOfAnotherUnit, IsNoCalibration) {
  const Robot robot = test::nominal_differential();
  for (const double factor : {1e3, 1e2, 1e-3})
    for (const bool has_headings : {true, false}) {
      std::vector<Recording> runs =
          test::recorded(robot, test::true_differential(), test::differential_paths(), 1);
      for (Recording& run : runs) {
        for (auto* column : {&run.reference.x_m, &run.reference.y_m})
          for (double& place : *column) place *= factor;
        if (!has_headings) std::ranges::fill(run.reference.heading_rad, kNotMeasured);
      }
      EXPECT_THROW(calibrate(runs, {}, robot, {}), CannotAnswer) << factor << has_headings;
    }
}

/// In curves chords of wheels that roll far too far wind up.
TEST(Stretches, AgreeHoweverFarTheWheelsRollTooFar) {
  const Robot right = test::nominal_differential();
  const std::vector<trundle::calibration::Run> runs =
      test::prepared(right, right, {circle(0.6, 1.5, TurnSense::cw), circle(0.6, 1.5, TurnSense::ccw)}, 1);
  for (const double factor : {1.0, 2.0, 43.7}) {
    Robot wrong = right;
    scale_wheels(factor, wrong);
    EXPECT_TRUE(stretches_agree(runs, wrong)) << factor;
    EXPECT_NEAR(initial_scale(runs, wrong).value_or(InitialScale{0.0}).times * factor, 1.0, 0.05);
  }
}

}  // namespace
}  // namespace trundle::calibration
