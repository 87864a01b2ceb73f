#include "trundle/slam/smoothing/many_starts.hpp"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "trundle/slam/smoothing/re_association.hpp"

#include "scale.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

/// Blind for a third of each round, on odometry that turns too much.
test::SlamWorld blind_world(std::uint64_t seed) {
  test::SlamWorld world =
      test::slam_world({.steps = 190, .sigma_turn_rad = 0.02, .seed = seed, .systematic = {0.0, 0.05, 0.0}});
  for (std::size_t k = 0; k < world.steps.size(); ++k)
    if (k % 63 > 42) world.steps[k].observations.clear();
  return world;
}

SlamInput hidden(const test::SlamWorld& world) {
  SlamInput input;
  input.steps = world.steps;
  for (SlamStep& step : input.steps)
    for (Observation& observation : step.observations) observation.landmark = kUnknownLandmark;
  return input;
}

double cost_of(const SmoothedSlam& smoothed, const LandmarkSensor& sensor) {
  const ShownFromPath robot{smoothed.shown, smoothed.trajectory, sensor};
  return smoothed.counts.cost + cost_of_explaining({&robot, 1}, smoothed.map);
}

bool are_same(const SmoothedSlam& a, const SmoothedSlam& b) {
  return a.counts.cost == b.counts.cost && are_same_associations(a.shown, b.shown);
}

/// A filter that was lost: every landmark is a new one in each third of the way, and most sightings
/// were taken for any.
SlamResult lost(SlamResult filtered) {
  const auto landmarks = static_cast<LandmarkId>(filtered.map.size());
  Random random(3);
  const std::vector<MappedLandmark> map = filtered.map;
  for (const LandmarkId third : {1, 2})
    for (MappedLandmark m : map) {
      m.id += third * landmarks;
      filtered.map.push_back(m);
    }
  for (std::size_t k = 0; k < filtered.reports.size(); ++k)
    for (ObservationReport& report : filtered.reports[k].observations) {
      if (random.uniform() < 0.7) report.landmark = static_cast<LandmarkId>(random.uniform() * landmarks);
      report.landmark += landmarks * static_cast<LandmarkId>(3 * k / filtered.reports.size());
    }
  return filtered;
}

TEST(ManyStarts, AreNoUseWhereAllHaveNamesOrThereIsOne) {
  const test::SlamWorld world = blind_world(2);
  SlamInput named;
  named.steps = world.steps;
  const SlamOptions filter{.method = SlamMethod::fastslam2, .particles = 20, .seed = 2};
  const SlamResult filtered = slam(named, world.sensor, filter);
  EXPECT_TRUE(are_same(smooth_from_many(named, world.sensor, filtered, filter, 5),
                       smooth(named, world.sensor, filtered)));
  const SlamInput unidentified = hidden(world);
  const SlamResult without = slam(unidentified, world.sensor, filter);
  EXPECT_TRUE(are_same(smooth_from_many(unidentified, world.sensor, without, filter, 1),
                       smooth(unidentified, world.sensor, without)));
}

TEST(ManyStarts, TheMostProbableExplanationIsKept) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const SlamOptions filter{.method = SlamMethod::fastslam2, .particles = 20, .seed = 2};
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const test::SlamWorld world = blind_world(seed);
    const SlamInput input = hidden(world);
    double least = std::numeric_limits<double>::infinity();
    for (std::uint64_t run = 0; run < 3; ++run) {
      SlamOptions other = filter;
      other.seed += run;
      least = std::min(least,
                       cost_of(smooth(input, world.sensor, slam(input, world.sensor, other)), world.sensor));
    }
    const SlamResult first = slam(input, world.sensor, filter);
    EXPECT_EQ(cost_of(smooth_from_many(input, world.sensor, first, filter, 3), world.sensor), least);
  }
}

TEST(ManyStarts, WhatAFilterWasLostInIsFoundAndKeepsItsNumbers) {
  const test::SlamWorld world = blind_world(4);
  const SlamInput input = hidden(world);
  const SlamOptions filter{.method = SlamMethod::ekf, .particles = 50, .seed = 2};
  SlamOptions good = filter;
  good.method = SlamMethod::fastslam2;
  const SlamResult filtered = lost(slam(input, world.sensor, good));
  const SmoothedSlam alone = smooth(input, world.sensor, filtered);
  const SmoothedSlam found = smooth_from_many(input, world.sensor, filtered, filter, 4);
  ASSERT_LT(cost_of(found, world.sensor), cost_of(alone, world.sensor));
  EXPECT_NEAR(static_cast<double>(found.map.size()), static_cast<double>(world.landmarks.size()), 2.0);
  // Where most sightings were taken for one landmark, that is its number; no two have the same.
  std::set<LandmarkId> numbers;
  for (const MappedLandmark& m : found.map) numbers.insert(m.id);
  EXPECT_EQ(numbers.size(), found.map.size());
  std::size_t sightings = 0, same = 0;
  for (std::size_t k = 0; k < input.steps.size(); ++k)
    for (std::size_t i = 0; i < found.shown[k].size(); ++i) {
      if (found.shown[k][i].landmark < 0) continue;
      EXPECT_TRUE(numbers.contains(found.shown[k][i].landmark));
      ++sightings;
      same += found.shown[k][i].landmark == filtered.reports[k].observations[i].landmark ? 1 : 0;
    }
  EXPECT_GT(same, sightings / 15);  // of a third of the way, a third
}

}  // namespace
}  // namespace trundle::slam
