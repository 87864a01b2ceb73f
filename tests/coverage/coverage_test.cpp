// Online odometry's end pose is unbiased and its covariance honest: a part of the matrix of
// docs/results/coverage.md, of which `./run bench coverage` prints the whole.
#include "coverage/coverage.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "scale.hpp"

namespace trundle::coverage {
namespace {

/// More readings are the same arithmetic once more: under sanitizers those of slow robots are enough.
bool is_left_out(double rate_hz) {
  return test::kSanitizers && rate_hz > 50.0;
}

/// Every chassis at every rate, four times: each motion once, every noise and count at least once, the
/// combinations different from chassis to chassis and from rate to rate.
std::vector<Cell> part_of_matrix(std::string_view chassis, std::size_t shift) {
  std::vector<Cell> cells;
  for (std::size_t rate = 0; rate < kRates.size(); ++rate) {
    if (is_left_out(kRates[rate])) continue;
    for (std::size_t motion = 0; motion < kMotions.size(); ++motion) {
      cells.push_back({.chassis = chassis,
                       .rate_hz = kRates[rate],
                       .k = kNoises[(motion + shift) % kNoises.size()],
                       .counts = kCounts[(2 * motion + rate + shift / 3) % kCounts.size()],
                       .motion = static_cast<Motion>(motion)});
    }
  }
  return cells;
}

/// Half the rates, counts at which rounding shows, and motions with and without further rests.
std::vector<Cell> learning_cells(std::string_view chassis) {
  std::vector<Cell> cells;
  for (const double rate : {50.0, 200.0}) {
    if (is_left_out(rate)) continue;
    for (const double counts : {100.0, 1000.0}) {
      for (const Motion motion : {Motion::straight, Motion::stop_and_go}) {
        cells.push_back({chassis, rate, 0.005, counts, motion, true});
      }
    }
  }
  return cells;
}

/// Each cell is within its limits, and the mean of all within the narrower ones of so many drives: what a
/// wrong weight takes away of the way, and what a wrong variance adds, has the same sign everywhere.
void expect_coverage(const std::vector<Cell>& cells, int seeds, std::size_t cells_in_all) {
  const Limits limit = limits(seeds, cells_in_all);
  const int count = static_cast<int>(cells.size());
  double along = 0.0;
  double nees = 0.0;
  for (const Cell& cell : cells) {
    const Tally tally = run_cell(cell, seeds);
    along += tally.bias().x() / count;
    nees += tally.nees() / count;
    EXPECT_TRUE(unbiased(tally, limit))
        << words(cell) << ": bias " << tally.bias().transpose() << " sigma, limit " << limit.bias;
    EXPECT_TRUE(honest(tally, limit)) << words(cell) << ": NEES " << tally.nees() << ", limits "
                                      << limit.nees_low << " to " << limit.nees_high;
  }
  const Limits together = limits(seeds * count, cells_in_all);
  EXPECT_LT(std::abs(along), together.bias) << cells.front().chassis;
  EXPECT_GT(nees, together.nees_low) << cells.front().chassis;
  EXPECT_LT(nees, together.nees_high) << cells.front().chassis;
}

TEST(Coverage, OfTheEndPose) {
  const int seeds = test::trials(60, 20);
  for (std::size_t i = 0; i < kChassis.size(); ++i) {
    expect_coverage(part_of_matrix(kChassis[i], i), seeds, kChassis.size() * kRates.size() * kMotions.size());
  }
}

TEST(Coverage, OfTheEndPoseWhereTheGyrosBiasIsLearned) {
  const int seeds = test::trials(60, 20);
  for (const std::string_view chassis : kChassis) {
    if (has_gyro(chassis)) expect_coverage(learning_cells(chassis), seeds, 32);
  }
}

}  // namespace
}  // namespace trundle::coverage
