// Which ways count as travel, and by what limits.
#include "trundle/odometry/rolling.hpp"

#include <cmath>
#include <numeric>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::odometry {
namespace {

using testing::DoubleNear;
using testing::Le;

/// Of a velocity that turns by a few milliradians in each row, as often as not less than its noise.
std::vector<double> sure_ways(double turn_per_sqrt_rad) {
  Chassis chassis;
  chassis.noise.turn_per_sqrt_rad = turn_per_sqrt_rad;
  const RollingGauge gauge(chassis);
  Random random(1, 1);
  Rolling rolling;
  std::vector<double> ways;
  for (int row = 0; row < 1000; ++row) {
    Increment increment;
    increment.turned[1] = 2e-3 + random.normal(2e-3);
    ways.push_back(gauge.add(rolling, increment)[1]);
  }
  return ways;
}

// Whoever looks for the noise goes by how variances change with it.
TEST(RollingGauge, WaysAreTheSameWithALittleMoreNoise) {
  int differ = 0;
  constexpr int kTrials = 200;
  for (int i = 0; i < kTrials; ++i) {
    const double noise = 0.01 * std::pow(4.0, static_cast<double>(i) / kTrials);
    if (sure_ways(noise) != sure_ways(noise * 1.0005)) ++differ;
  }
  // Between 0.01 and 0.04 the limit, 4 k² in radians, passes four powers of two.
  EXPECT_THAT(differ, Le(4));
}

TEST(RollingGauge, WhatEachNoiseFindsIsTheWholeWay) {
  for (const double noise : {0.01, 0.02, 0.04}) {
    const std::vector<double> ways = sure_ways(noise);
    EXPECT_THAT(std::accumulate(ways.begin(), ways.end(), 0.0), DoubleNear(2.0, 0.4)) << noise;
  }
}

}  // namespace
}  // namespace trundle::odometry
