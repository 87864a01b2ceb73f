// What every filter owes where sightings have no names.
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "trundle/slam/slam.hpp"

#include "scale.hpp"
#include "slam/every_method.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

class UnknownIds : public testing::TestWithParam<SlamMethod> {
 protected:
  SlamFilter filter(const test::SlamWorld& world, std::size_t particles = 64) const {
    return SlamFilter(world.sensor, {.method = GetParam(), .particles = particles, .seed = 3});
  }
};

std::vector<Observation> without_names(std::vector<Observation> observations) {
  std::ranges::reverse(observations);
  for (Observation& observation : observations) observation.landmark = kUnknownLandmark;
  return observations;
}

double distance(const SlamFilter& filter, const Pose2& truth) {
  return (filter.estimate().pose.translation() - truth.translation()).norm();
}

/// Landmarks of a map that stand within half a metre of one that is there.
std::size_t right_ones(const SlamFilter& filter, const test::SlamWorld& world) {
  std::size_t right = 0;
  for (const MappedLandmark& m : filter.map())
    right +=
        std::ranges::any_of(world.landmarks, [&](const Vector2& l) { return (l - m.position).norm() < 0.5; });
  return right;
}

std::size_t count(const StepReport& report, Decision decision) {
  return static_cast<std::size_t>(
      std::ranges::count(report.observations, decision, &ObservationReport::decision));
}

/// No two landmarks within 0.8 m, where no filter could tell them apart.
test::SlamWorld clear_world(int steps = 200, std::uint64_t first_seed = 1) {
  for (std::uint64_t seed = first_seed;; ++seed) {
    test::SlamWorld world = test::slam_world({.steps = steps, .seed = seed});
    bool clear = true;
    for (std::size_t i = 0; i < world.landmarks.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        clear = clear && (world.landmarks[i] - world.landmarks[j]).norm() > 0.8;
    if (clear) return world;
  }
}

TEST_P(UnknownIds, TheMapAndThePathAreFound) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  // One seed with 64 particles differs from another by a factor of two: its logarithm has a sigma of 0.6.
  constexpr int kWorlds = 16;
  double named_error = 0.0;
  double unidentified_error = 0.0;
  double landmarks = 0.0;
  double right = 0.0;
  for (int i = 0; i < kWorlds; ++i) {
    const test::SlamWorld world = clear_world(200, 100 * static_cast<std::uint64_t>(i) + 1);
    SlamFilter named = filter(world);
    SlamFilter unidentified = filter(world);
    for (std::size_t k = 0; k < world.steps.size(); ++k) {
      named.step(world.steps[k].motion, world.steps[k].observations);
      unidentified.step(world.steps[k].motion, without_names(world.steps[k].observations));
      named_error += distance(named, world.truth[k]);
      unidentified_error += distance(unidentified, world.truth[k]);
    }
    landmarks += static_cast<double>(unidentified.map().size()) / kWorlds;
    right += static_cast<double>(right_ones(unidentified, world)) / kWorlds;
  }
  EXPECT_LT(unidentified_error, 1.45 * named_error);  // 1.2 and 0.6/√16 · 1.65
  EXPECT_NEAR(landmarks, 20.0, 0.5);
  EXPECT_GT(right, 19.5);
}

TEST_P(UnknownIds, SpuriousSightingsDoNotBreakIt) {
  const test::SlamWorld world = clear_world();
  SlamFilter unidentified = filter(world);
  Random random(5);
  double worst = 0.0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation> seen = without_names(world.steps[k].observations);
    if (k % 2 == 0) seen.push_back({kUnknownLandmark, random.uniform(0.5, 8.0), random.uniform(-kPi, kPi)});
    unidentified.step(world.steps[k].motion, seen);
    worst = std::max(worst, distance(unidentified, world.truth[k]));
  }
  EXPECT_LT(worst, 0.6);
  EXPECT_GE(right_ones(unidentified, world), world.landmarks.size() - 2);
  // Of 100 spurious ones those that the robot comes near again are removed, the others stay tentative.
  EXPECT_LE(unidentified.map().size(), world.landmarks.size() + 2);
  EXPECT_GT(unidentified.tentative().size(), 5U);
}

TEST_P(UnknownIds, ALandmarkBehindTheRobotIsNoSpecialCase) {
  // Straight behind, the bearing jumps between +180° and −180° with the noise.
  test::SlamWorld world;
  world.sensor.body_from_sensor = {};
  SlamFilter unidentified = filter(world);
  Random random(6);
  const Motion motion = motion_of({0.1, 0.0, 0.0}, Vector3(1e-4, 1e-6, 1e-5).asDiagonal());
  std::size_t matched = 0;
  for (int k = 0; k < 40; ++k) {
    const double x = 0.1 * (k + 1);
    const std::vector<Observation> seen = {
        {kUnknownLandmark, 2.0 + x + random.normal(0.05), wrap_angle(kPi + random.normal(0.02))}};
    matched += count(unidentified.step(motion, seen), Decision::matched);
  }
  EXPECT_EQ(unidentified.map().size(), 1U);
  EXPECT_EQ(matched, 39U);
  EXPECT_NEAR(unidentified.map().front().position.x(), -2.0, 0.3);
}

TEST_P(UnknownIds, InvalidReadingsAreCountedAndChangeNothing) {
  const test::SlamWorld world = clear_world(60);
  SlamFilter with = filter(world);
  SlamFilter without = filter(world);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const SlamStep& step : world.steps) {
    const std::vector<Observation> seen = without_names(step.observations);
    std::vector<Observation> spoilt = seen;
    spoilt.push_back({kUnknownLandmark, kNan, 0.0});
    spoilt.push_back({kUnknownLandmark, 1.0, kNan});
    spoilt.push_back({kUnknownLandmark, -1.0, 0.0});
    without.step(step.motion, seen);
    EXPECT_EQ(count(with.step(step.motion, spoilt), Decision::invalid), 3U);
  }
  EXPECT_EQ(with.estimate().pose.x, without.estimate().pose.x);
  EXPECT_EQ(with.map().size(), without.map().size());
}

TEST_P(UnknownIds, DuplicatesAreOneLandmarkSeenTwice) {
  // Every sighting twice: a second landmark beside each would be the other explanation, and is as good; but
  // nothing may break, and the path stays right.
  const test::SlamWorld world = clear_world(120);
  SlamFilter unidentified = filter(world);
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation> seen = without_names(world.steps[k].observations);
    const std::vector<Observation> once = seen;
    seen.insert(seen.end(), once.begin(), once.end());
    unidentified.step(world.steps[k].motion, seen);
    ASSERT_LT(distance(unidentified, world.truth[k]), 0.8);
  }
  EXPECT_LE(unidentified.map().size(), 2 * world.landmarks.size() + 4);
}

TEST_P(UnknownIds, AllSightingsWrong) {
  const test::SlamWorld world = clear_world(test::trials(150, 30));
  SlamFilter unidentified = filter(world);
  Random random(7);
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation> wrong;
    for (std::size_t i = 0; i < world.steps[k].observations.size(); ++i)
      wrong.push_back({kUnknownLandmark, random.uniform(0.5, 8.0), random.uniform(-kPi, kPi)});
    unidentified.step(world.steps[k].motion, wrong);
    const PoseEstimate estimate = unidentified.estimate();
    ASSERT_TRUE(std::isfinite(estimate.pose.x + estimate.pose.y + estimate.pose.heading));
    ASSERT_TRUE(estimate.covariance.allFinite());
  }
}

TEST_P(UnknownIds, NothingSeenForLong) {
  const test::SlamWorld world = clear_world(200);
  SlamFilter unidentified = filter(world);
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    const bool blind = k > 60 && k < 100;
    unidentified.step(world.steps[k].motion,
                      blind ? std::vector<Observation>{} : without_names(world.steps[k].observations));
  }
  EXPECT_LT(distance(unidentified, world.truth.back()), 0.6);
  EXPECT_LE(unidentified.map().size(), world.landmarks.size() + 3);
}

TEST_P(UnknownIds, SomeMayHaveNames) {
  const test::SlamWorld world = clear_world();
  const auto named = static_cast<LandmarkId>(world.landmarks.size() / 2);
  SlamFilter mixed(world.sensor,
                   {.method = GetParam(), .particles = 64, .seed = 3, .first_unidentified = named});
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation> seen = world.steps[k].observations;
    for (Observation& observation : seen)
      if (observation.landmark >= named) observation.landmark = kUnknownLandmark;
    mixed.step(world.steps[k].motion, seen);
    ASSERT_LT(distance(mixed, world.truth[k]), 0.6);
  }
  std::size_t names = 0;
  std::set<LandmarkId> ids;
  for (const MappedLandmark& m : mixed.map()) {
    ids.insert(m.id);
    if (m.id >= named) continue;
    ++names;
    EXPECT_LT((m.position - world.landmarks[static_cast<std::size_t>(m.id)]).norm(), 0.5);
  }
  EXPECT_EQ(ids.size(), mixed.map().size());
  EXPECT_EQ(names, static_cast<std::size_t>(named));
  EXPECT_NEAR(static_cast<double>(mixed.map().size()), static_cast<double>(world.landmarks.size()), 1.0);
  EXPECT_GE(right_ones(mixed, world), world.landmarks.size() - 1);
}

TEST_P(UnknownIds, AWholeRecordingNumbersThemAboveAllNames) {
  const test::SlamWorld world = clear_world();
  const auto named = static_cast<LandmarkId>(world.landmarks.size() / 2);
  SlamInput input;
  input.steps = world.steps;
  for (LandmarkId id = 0; id < named; ++id) input.landmarks.push_back("name " + std::to_string(id));
  for (std::size_t k = 0; k < input.steps.size(); ++k) {
    std::vector<Observation>& seen = input.steps[k].observations;
    // At first there are none with names: their numbers must be kept for them all the same.
    if (k < 20) std::erase_if(seen, [&](const Observation& o) { return o.landmark < named; });
    for (Observation& observation : seen)
      if (observation.landmark >= named) observation.landmark = kUnknownLandmark;
  }
  const SlamResult result = slam(input, world.sensor, {.method = GetParam(), .particles = 64, .seed = 3});
  for (std::size_t k = 0; k < input.steps.size(); ++k)
    for (std::size_t i = 0; i < input.steps[k].observations.size(); ++i) {
      const ObservationReport& report = result.reports[k].observations[i];
      if (report.decision != Decision::created) continue;
      EXPECT_EQ(report.landmark < named, input.steps[k].observations[i].landmark != kUnknownLandmark);
    }
}

TEST_P(UnknownIds, ANumberThatBecomesANameIsThatOfTheNamedOne) {
  SlamFilter filter(LandmarkSensor{}, {.method = GetParam(), .particles = 8});
  const Motion still = motion_of({}, 1e-8 * Matrix3::Identity());
  const std::vector<Observation> unidentified = {{kUnknownLandmark, 2.0, 0.0}, {kUnknownLandmark, 2.0, 1.0}};
  filter.step(still, unidentified);
  filter.step(still, std::vector<Observation>{{1, 3.0, -1.0}});
  std::set<LandmarkId> ids;
  std::vector<MappedLandmark> all = filter.map();
  for (const MappedLandmark& tentative : filter.tentative()) all.push_back(tentative);
  for (const MappedLandmark& m : all) {
    ids.insert(m.id);
    if (m.id == 1) {
      EXPECT_NEAR(m.position.norm(), 3.0, 0.3);
    }
  }
  EXPECT_EQ(ids, (std::set<LandmarkId>{0, 1, 2}));
  const StepReport& again = filter.step(still, unidentified);
  EXPECT_EQ(count(again, Decision::matched), 2U);
}

TEST_P(UnknownIds, OneParticle) {
  const test::SlamWorld world = clear_world(60);
  SlamFilter unidentified = filter(world, 1);
  for (const SlamStep& step : world.steps) unidentified.step(step.motion, without_names(step.observations));
  EXPECT_GE(right_ones(unidentified, world), 10U);
}

TEST_P(UnknownIds, ALandmarkThatIsTakenAwayLeavesTheMap) {
  const test::SlamWorld world = clear_world(320);
  SlamFilter unidentified = filter(world);
  const auto off_path = [](const Vector2& l) { return std::abs((l - Vector2(0.0, 5.0)).norm() - 5.0); };
  const auto gone = std::ranges::min_element(world.landmarks, {}, off_path);
  const auto number = static_cast<LandmarkId>(gone - world.landmarks.begin());
  const auto is_mapped = [&] {
    return std::ranges::any_of(unidentified.map(),
                               [&](const MappedLandmark& m) { return (m.position - *gone).norm() < 0.5; });
  };
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation> seen = world.steps[k].observations;
    // Occluded for a moment, and after two thirds of the way gone for good.
    const bool is_hidden = (k >= 130 && k < 132) || k >= 200;
    if (is_hidden) std::erase_if(seen, [&](const Observation& o) { return o.landmark == number; });
    unidentified.step(world.steps[k].motion, without_names(seen));
    if (k == 140) {
      EXPECT_TRUE(is_mapped());
    }
  }
  EXPECT_FALSE(is_mapped());
  EXPECT_GE(unidentified.map().size(), world.landmarks.size() - 3);
}

TEST_P(UnknownIds, SameSeedSameResult) {
  const test::SlamWorld world = clear_world(80);
  SlamFilter first = filter(world);
  SlamFilter second = filter(world);
  for (const SlamStep& step : world.steps) {
    first.step(step.motion, without_names(step.observations));
    second.step(step.motion, without_names(step.observations));
    ASSERT_EQ(first.estimate().pose.x, second.estimate().pose.x);
  }
}

INSTANTIATE_TEST_SUITE_P(OfEveryFilter, UnknownIds, testing::ValuesIn(test::every_method()),
                         [](const auto& method) { return std::string(name_of(method.param)); });

}  // namespace
}  // namespace trundle::slam
