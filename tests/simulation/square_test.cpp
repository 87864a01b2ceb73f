#include <cmath>

#include <gtest/gtest.h>

#include "robots.hpp"

namespace trundle::simulation {
namespace {

using test::exact_scenario;
using test::quiet_differential;

/// Where the robot really ends when its odometry says that it is back at the start.
Pose2 end_of_square(const Robot& truth, TurnSense sense) {
  const Simulation run = simulate(exact_scenario(quiet_differential(), truth, square(2.0, sense)));
  return run.truth.body.poses.back().pose;
}

struct TableRow {
  double left_m, right_m, track_m, e_max_m;
};

class SquareTable : public testing::TestWithParam<TableRow> {};

TEST_P(SquareTable, ReproducesTheErrorBeforeCalibration) {
  const TableRow& row = GetParam();
  const Robot truth = quiet_differential(row.left_m, row.right_m, row.track_m);
  const double cw = end_of_square(truth, TurnSense::cw).translation().norm();
  const double ccw = end_of_square(truth, TurnSense::ccw).translation().norm();
  EXPECT_NEAR(std::max(cw, ccw), row.e_max_m, 0.5e-4);
}

TEST_P(SquareTable, HeadingErrorsFollowTheExactEffects) {
  const TableRow& row = GetParam();
  const Robot truth = quiet_differential(row.left_m, row.right_m, row.track_m);
  const double mean = 0.5 * (row.left_m + row.right_m);
  const double alpha = 0.5 * kPi * (1.0 - 0.50 / row.track_m * mean / 0.15);
  const double beta = 2.0 * (row.right_m - row.left_m) / (0.15 * row.track_m);
  EXPECT_NEAR(end_of_square(truth, TurnSense::cw).heading + 2.0 * kPi, 4.0 * alpha + 4.0 * beta, 1e-12);
  EXPECT_NEAR(end_of_square(truth, TurnSense::ccw).heading - 2.0 * kPi, -4.0 * alpha + 4.0 * beta, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(CheckValues, SquareTable,
                         testing::Values(TableRow{0.1503, 0.1497, 0.51, 0.2688},
                                         TableRow{0.1500, 0.1515, 0.53, 0.7149},
                                         TableRow{0.1550, 0.1530, 0.47, 1.0404}));

TEST(Square, PerfectRobotReturns) {
  const Pose2 end = end_of_square(quiet_differential(), TurnSense::ccw);
  EXPECT_NEAR(end.x, 0.0, 1e-12);
  EXPECT_NEAR(end.y, 0.0, 1e-12);
  EXPECT_NEAR(end.heading, 2.0 * kPi, 1e-12);
}

}  // namespace
}  // namespace trundle::simulation
