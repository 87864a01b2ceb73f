#include "trundle/slam/smoothing/re_association.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "trundle/slam/smoothing/smoother.hpp"

#include "scale.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

const LandmarkSensor kRangeFinder = test::SlamWorld{}.sensor;

MappedLandmark landmark(LandmarkId id, double x, double y) {
  return {id, {x, y}, Matrix2::Identity() * 0.01, 5};
}

std::vector<Observation> hidden(std::vector<Observation> observations) {
  for (Observation& observation : observations) observation.landmark = kUnknownLandmark;
  return observations;
}

Matrix2 as_sure_as_one_another(LandmarkId, LandmarkId) {
  return Matrix2::Identity() * 0.02;
}

ShownObservations again_by(const SlamInput& input, const ShownFromPath& robot,
                           std::span<const MappedLandmark> map) {
  const SlamInput* const inputs[] = {&input};
  return reassociated(inputs, {&robot, 1}, map).front();
}

TEST(ReAssociation, DuplicatesAreOneLandmarkThatWasMappedTwice) {
  const std::vector<MappedLandmark> map = {landmark(3, 0.0, 0.0), landmark(5, 0.2, 0.1),
                                           landmark(7, 2.0, 0.0)};
  const ShownObservations shown = {{{3, 1.0, 0.0}, {7, 2.0, 1.0}}, {{5, 1.0, 0.0}}};
  EXPECT_EQ(duplicates_in({&shown, 1}, map, kRangeFinder.max_range_m, 0, as_sure_as_one_another),
            (std::vector<LandmarkPair>{{3, 5}}));
}

TEST(ReAssociation, TheClearestDuplicatesComeFirstAndNoneHasTwo) {
  const std::vector<MappedLandmark> map = {landmark(0, 0.0, 0.0), landmark(1, 0.2, 0.0),
                                           landmark(2, 0.25, 0.0), landmark(3, 5.0, 0.0),
                                           landmark(4, 5.1, 0.0)};
  EXPECT_EQ(duplicates_in({}, map, kRangeFinder.max_range_m, 0, as_sure_as_one_another),
            (std::vector<LandmarkPair>{{1, 2}, {3, 4}}));
}

TEST(ReAssociation, LandmarksSeenInOneInstantAreTwo) {
  const std::vector<MappedLandmark> map = {landmark(3, 0.0, 0.0), landmark(5, 0.2, 0.1)};
  const ShownObservations shown = {{{3, 1.0, 0.0}, {5, 1.1, 0.1}}};
  EXPECT_TRUE(duplicates_in({&shown, 1}, map, kRangeFinder.max_range_m, 0, as_sure_as_one_another).empty());
}

TEST(ReAssociation, TwoNamesAreTwoLandmarks) {
  const std::vector<MappedLandmark> map = {landmark(0, 0.0, 0.0), landmark(1, 0.1, 0.0),
                                           landmark(2, 5.0, 0.0), landmark(3, 5.1, 0.0)};
  EXPECT_EQ(duplicates_in({}, map, kRangeFinder.max_range_m, 3, as_sure_as_one_another),
            (std::vector<LandmarkPair>{{2, 3}}));
}

TEST(ReAssociation, ANameIsKeptAndNoOtherSightingOfTheInstantShowsItsLandmark) {
  SmoothedSlam smoothed;
  smoothed.trajectory.poses = {{0.0, {}}};
  smoothed.map = {landmark(0, 2.0, 0.0), landmark(1, 2.3, 0.0)};
  SlamInput input;
  input.steps = {{0.0, {}, {{0, 2.3, 0.0}, {kUnknownLandmark, 2.0, 0.0}, {kUnknownLandmark, 2.28, 0.0}}}};
  LandmarkSensor precise;
  precise.range_sigma_m = 0.05;
  precise.bearing_sigma_rad = 0.02;
  const ShownObservations seen = {input.steps[0].observations};
  const ShownFromPath robot{seen, smoothed.trajectory, precise};
  const ShownObservations again = again_by(input, robot, smoothed.map);
  EXPECT_EQ(again[0][0].landmark, 0);
  EXPECT_EQ(again[0][1].landmark, kUnknownLandmark);
  EXPECT_EQ(again[0][2].landmark, 1);
}

TEST(ReAssociation, MergingRenamesTheSecondOfAPair) {
  const ShownObservations shown = {{{3, 1.0, 0.0}, {7, 2.0, 1.0}}, {{5, 1.0, 0.0}}};
  const std::vector<LandmarkPair> pairs = {{3, 5}};
  const ShownObservations merged = with_merged(shown, pairs);
  EXPECT_FALSE(are_same_associations(shown, merged));
  EXPECT_EQ(merged[0][0].landmark, 3);
  EXPECT_EQ(merged[0][1].landmark, 7);
  EXPECT_EQ(merged[1][0].landmark, 3);
}

TEST(ReAssociation, FewerLandmarksExplainMore) {
  const ShownObservations two = {{{1, 1.0, 0.0}}, {{2, 1.0, 0.0}}};
  const ShownObservations one = {{{1, 1.0, 0.0}}, {{1, 1.0, 0.0}}};
  const ShownObservations none = {{{1, 1.0, 0.0}}, {{kUnknownLandmark, 1.0, 0.0}}};
  SmoothedSlam smoothed;
  smoothed.trajectory.poses = {{0.0, {}}, {1.0, {}}};
  const auto cost = [&](const ShownObservations& shown) {
    const ShownFromPath robot{shown, smoothed.trajectory, kRangeFinder};
    return cost_of_explaining({&robot, 1}, smoothed.map);
  };
  EXPECT_LT(cost(one), cost(two));
  EXPECT_EQ(cost(none), cost(two));
}

/// Two landmarks, read 400 times by a sensor that turns about itself, and a third one two sigmas behind the
/// nearer, which is not there.
struct LandmarkWithTwin {
  static constexpr LandmarkId kReal = 0, kTwin = 1, kFar = 2;
  LandmarkSensor sensor = {{}, 0.3, 0.05, 10.0, 0.0};
  SmoothedSlam smoothed;
  SlamInput input;
  ShownObservations shown;

  explicit LandmarkWithTwin(std::uint64_t seed) {
    Random random(seed);
    smoothed.map = {landmark(kReal, 5.0, 0.0), landmark(kTwin, 5.6, 0.0), landmark(kFar, -8.0, 0.0)};
    for (int k = 0; k < 400; ++k) {
      const Pose2 pose{0.0, 0.0, 0.05 * k};
      smoothed.trajectory.poses.push_back({0.1 * k, pose});
      const auto read = [&](LandmarkId id, double range_m, double bearing_rad) {
        const double read_m = range_m + random.normal(sensor.range_sigma_m);
        return Observation{id, read_m, wrap_angle(bearing_rad + random.normal(sensor.bearing_sigma_rad))};
      };
      const Observation near = read(k % 100 == 0 ? kTwin : kReal, 5.0, -pose.heading);
      const Observation far = read(kFar, 8.0, kPi - pose.heading);
      shown.push_back({near, far});
      input.steps.push_back({0.1 * k, {}, hidden({near, far})});
    }
  }
  [[nodiscard]] ShownObservations by_range(double limit_m) const {
    ShownObservations parted = shown;
    for (auto& step : parted) step[0].landmark = step[0].range_m < limit_m ? kReal : kTwin;
    return parted;
  }
  [[nodiscard]] double cost(const ShownObservations& explanation) const {
    const ShownFromPath robot{explanation, smoothed.trajectory, sensor};
    return cost_of_explaining({&robot, 1}, smoothed.map);
  }
};

// Two halves of one landmark's readings scatter less than all of them: of n readings in two sigmas, χ² falls
// by 2/π n where they are parted through the middle. So what speaks against the twin has to cost more: that
// it is missed whenever the other is seen.
TEST(ReAssociation, ALandmarkIsNotPartedInTwo) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const LandmarkWithTwin seen(seed);
    const auto n = static_cast<double>(seen.shown.size());
    EXPECT_GT(seen.cost(seen.by_range(5.0)) - seen.cost(seen.by_range(100.0)), 1.5 * 2.0 / kPi * n);
    const ShownFromPath robot{seen.shown, seen.smoothed.trajectory, seen.sensor};
    const ShownObservations again = again_by(seen.input, robot, seen.smoothed.map);
    const auto shows_twin = [](const auto& step) { return step[0].landmark == LandmarkWithTwin::kTwin; };
    EXPECT_LE(std::ranges::count_if(again, shows_twin), 4)
        << seed;  // as few as it has: 1 in 6 lie nearer to it
  }
}

TEST(ReAssociation, SightingsTakenForOthersAreTakenForWhatTheyShow) {
  const test::SlamWorld world = test::slam_world({.steps = 100});
  SmoothedSlam smoothed;
  ShownObservations wrong;
  for (std::size_t i = 0; i < world.landmarks.size(); ++i)
    smoothed.map.push_back({static_cast<LandmarkId>(i), world.landmarks[i], Matrix2::Identity() * 1e-4, 5});
  Random random(4);
  std::size_t sightings = 0, right = 0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    smoothed.trajectory.poses.push_back({world.steps[k].time_s, world.truth[k]});
    smoothed.trajectory.covariances.push_back(Matrix3::Identity() * 1e-4);
    wrong.push_back(world.steps[k].observations);
    for (Observation& observation : wrong.back())
      if (random.uniform() < 0.2) observation.landmark = random.uniform() < 0.5 ? kUnknownLandmark : 0;
  }
  SlamInput unidentified;
  unidentified.steps = world.steps;
  for (SlamStep& step : unidentified.steps) step.observations = hidden(step.observations);
  const ShownFromPath robot{wrong, smoothed.trajectory, kRangeFinder};
  const ShownObservations again = again_by(unidentified, robot, smoothed.map);
  for (std::size_t k = 0; k < again.size(); ++k)
    for (std::size_t i = 0; i < again[k].size(); ++i) {
      ++sightings;
      right += again[k][i].landmark == world.steps[k].observations[i].landmark ? 1 : 0;
    }
  EXPECT_GT(right, sightings * 97 / 100);  // a few landmarks stand within 3 sigma of each other
}

/// A filter that mapped every landmark anew after half of the way, and took one sighting in twenty for
/// another.
SlamResult confused(SlamResult filtered, LandmarkId landmarks) {
  Random random(9);
  for (std::size_t k = 0; k < filtered.reports.size(); ++k)
    for (ObservationReport& report : filtered.reports[k].observations) {
      if (random.uniform() < 0.05) report.landmark = static_cast<LandmarkId>(random.uniform() * landmarks);
      if (2 * k > filtered.reports.size()) report.landmark += landmarks;
    }
  const std::vector<MappedLandmark> map = filtered.map;
  for (MappedLandmark m : map) {
    m.id += landmarks;
    filtered.map.push_back(m);
  }
  return filtered;
}

TEST(ReAssociation, WhatWasMappedTwiceIsMerged) {
  test::SlamWorld world = test::slam_world({.steps = 200, .landmarks = 12, .seed = 4});
  SlamInput input, unidentified;
  input.steps = unidentified.steps = world.steps;
  for (SlamStep& step : unidentified.steps) step.observations = hidden(step.observations);
  const SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::fastslam2, .particles = 30});
  const SmoothedSlam with_names = smooth(input, world.sensor, filtered);
  const SmoothedSlam without = smooth(unidentified, world.sensor, confused(filtered, 12));
  EXPECT_EQ(without.map.size(), 12U);
  EXPECT_GT(without.counts.sightings, with_names.counts.sightings * 99 / 100);
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const Vector2 apart =
        without.trajectory.poses[k].pose.translation() - with_names.trajectory.poses[k].pose.translation();
    ASSERT_LT(apart.norm(), 0.05);
  }
}

/// The robot drives blind for a third of each round, on odometry that turns too much.
TEST(ReAssociation, WithoutNamesTheSmootherFindsWhatItFindsWithThem) {
  double with_names = 0.0, without = 0.0, landmarks = 0.0;
  const int worlds = test::trials(12, 4);
  for (int trial = 0; trial < worlds; ++trial) {
    const test::SlamWorld world = test::slam_world({.steps = 190,
                                                    .sigma_turn_rad = 0.02,
                                                    .seed = static_cast<std::uint64_t>(trial) + 1,
                                                    .systematic = {0.0, 0.05, 0.0}});
    SlamInput input;
    input.steps = world.steps;
    for (std::size_t k = 0; k < input.steps.size(); ++k)
      if (k % 63 > 42) input.steps[k].observations.clear();
    SlamInput unidentified = input;
    for (SlamStep& step : unidentified.steps) step.observations = hidden(step.observations);
    const SlamOptions options{.method = SlamMethod::fastslam2, .particles = 50, .seed = 2};
    with_names += test::position_rms(
        smooth(input, world.sensor, slam(input, world.sensor, options)).trajectory, world.truth);
    const SmoothedSlam smoothed =
        smooth(unidentified, world.sensor, slam(unidentified, world.sensor, options));
    without += test::position_rms(smoothed.trajectory, world.truth);
    landmarks += static_cast<double>(smoothed.map.size()) / worlds;
  }
  EXPECT_LT(without, 1.2 * with_names);
  EXPECT_NEAR(landmarks, 20.0, 1.0);
}

}  // namespace
}  // namespace trundle::slam
