#include "trundle/slam/doubts.hpp"

#include <gmock/gmock.h>

#include "slam/world.hpp"

namespace trundle::slam {
namespace {

SlamInput input_of(const test::SlamWorld& world) {
  SlamInput input;
  input.steps = world.steps;
  for (std::size_t k = 0; k < input.steps.size(); ++k) input.steps[k].time_s = static_cast<double>(k);
  return input;
}

std::vector<Finding> doubts_of(const test::SlamWorld& world) {
  const SlamInput input = input_of(world);
  const SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::ekf});
  const SmoothedSlam smoothed = smooth(input, world.sensor, filtered);
  return doubts_about(input, filtered, &smoothed);
}

TEST(Doubts, ThereAreNoneAboutAnHonestRun) {
  EXPECT_TRUE(doubts_of(test::slam_world({.steps = 200})).empty());
}

TEST(Doubts, OutliersAloneAreNone) {
  test::SlamWorld world = test::slam_world({.steps = 400});
  Random random(5);
  for (SlamStep& step : world.steps)
    for (Observation& observation : step.observations)
      if (random.uniform() < 0.1) observation.bearing_rad = random.uniform(-kPi, kPi);
  EXPECT_TRUE(doubts_of(world).empty());
}

TEST(Doubts, SaysWhenTheFilterWasLost) {
  test::SlamWorld world = test::slam_world({.steps = 200});
  for (std::size_t k = 120; k < 200; ++k)  // someone has turned the sensor
    for (Observation& observation : world.steps[k].observations) observation.bearing_rad += 1.0;
  const std::vector<Finding> doubts = doubts_of(world);
  ASSERT_FALSE(doubts.empty());
  EXPECT_EQ(doubts.front().code, FindingCode::lost);
  EXPECT_THAT(describe(doubts.front()), testing::StartsWith("from 120.0 s to "));
}

TEST(Doubts, SaysWhenSigmasAreTooSmall) {
  test::SlamWorld world = test::slam_world({.steps = 200});
  world.sensor.range_sigma_m /= 2.5;
  world.sensor.bearing_sigma_rad /= 2.5;
  const std::vector<Finding> doubts = doubts_of(world);
  ASSERT_FALSE(doubts.empty());
  EXPECT_EQ(doubts.back().code, FindingCode::noise);
}

}  // namespace
}  // namespace trundle::slam
