#include "trundle/slam/localization/global_search.hpp"

#include <set>

#include <gtest/gtest.h>

#include "trundle/slam/localization/sighted_pairs.hpp"

#include "slam/field.hpp"

namespace trundle::slam {
namespace {

std::vector<Vector2> square_grid(int side, double apart_m) {
  std::vector<Vector2> places;
  for (int i = 0; i < side * side; ++i) places.push_back(apart_m * Vector2(i % side, i / side));
  return places;
}

/// What a robot sees at first.
LocalMap first_look(test::Field& field, bool named) {
  LocalMap seen(field.sensor());
  for (SlamStep step = field.step(named);; step = field.step(named)) {
    seen.step(step.motion, step.observations);
    if (!step.observations.empty()) return seen;
  }
}

TEST(GlobalSearch, FindsTheOnePlaceOfALargeMapFromOneLook) {
  for (const bool named : {true, false})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      test::Field field(
          {.landmarks = 2000, .side_m = 90.0, .outlier_share = 0.0, .seen_at_once = 12, .seed = seed});
      const LocalMap seen = first_look(field, named);
      const FoundPoses found = find_poses(seen, field.map(), field.sensor(), {});
      ASSERT_FALSE(found.poses.empty());
      EXPECT_TRUE(test::is_right(found.poses.front().pose, field.truth()));
      EXPECT_EQ(found.poses.front().matched, seen.points().size());
      EXPECT_FALSE(found.is_ambiguous);
    }
}

// One of the points shows nothing of the map: it spoils one of the pairs, not all.
TEST(GlobalSearch, FindsItThoughSomeOfWhatIsSeenIsNotInTheMap) {
  int right = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    test::Field field(
        {.landmarks = 300, .side_m = 35.0, .outlier_share = 0.2, .seen_at_once = 12, .seed = seed});
    const LocalMap seen = first_look(field, false);
    const FoundPoses found = find_poses(seen, field.map(), field.sensor(), {});
    right += !found.poses.empty() && test::is_right(found.poses.front().pose, field.truth()) ? 1 : 0;
  }
  EXPECT_GE(right, 19);
}

TEST(GlobalSearch, EndsWhereMorePlacesThanCanBeFollowedExplainAllThatIsSeen) {
  test::Field field({.outlier_share = 0.0, .seen_at_once = 12, .layout = square_grid(25, 2.0)});
  const FoundPoses found = find_poses(first_look(field, false), field.map(), field.sensor(), {});
  EXPECT_TRUE(found.is_ambiguous);
  EXPECT_EQ(found.poses.size(), kMostHypotheses);
  for (const PoseHypothesis& pose : found.poses) EXPECT_EQ(pose.matched, 12U);
}

// Its name says which landmark it is, however many lie like it.
TEST(GlobalSearch, IsNotAmbiguousWhereLandmarksHaveNames) {
  test::Field field({.outlier_share = 0.0, .seen_at_once = 12, .layout = square_grid(25, 2.0)});
  const FoundPoses found = find_poses(first_look(field, true), field.map(), field.sensor(), {});
  EXPECT_FALSE(found.is_ambiguous);
  ASSERT_FALSE(found.poses.empty());
  EXPECT_TRUE(test::is_right(found.poses.front().pose, field.truth()));
}

TEST(GlobalSearch, ANewPlaceIsNotClaimedWhileNotAllCanBeTried) {
  test::Field field({.side_m = 48.0, .seen_at_once = 12, .layout = square_grid(25, 2.0)});
  Localizer localizer(field.map(), field.sensor(), {});
  for (int k = 0; k < 300; ++k) {
    const SlamStep step = field.step(false);
    localizer.step(step.motion, step.observations);
    ASSERT_FALSE(localizer.estimate()) << k;
  }
}

// Landmarks 1 m apart, and one that is 3.7 m away from its neighbour: that distance is looked up first.
TEST(SightedPairs, TheRarestDistanceComesFirstAndNoPointTwice) {
  const LandmarkSensor sensor{{}, 0.02, radians(0.2), 12.0, 0.0};
  std::vector<KnownLandmark> landmarks;
  for (int i = 0; i < 40; ++i) landmarks.push_back({{1.0 * i, 0.0}});
  landmarks.push_back({{20.0, 3.7}});
  const KnownMap map(landmarks, 24.0);
  LocalMap seen(sensor);
  std::vector<Observation> look;
  for (const LandmarkId id : {18, 19, 20, 21, 22, 40}) {
    const Vector2 place = map[id].position - Vector2(20.0, -2.0);
    look.push_back({kUnknownLandmark, place.norm(), std::atan2(place.y(), place.x())});
  }
  seen.step({}, look);
  const auto pairs = rarest_pairs(seen, map, {.most_pairs = 3});
  ASSERT_EQ(pairs.size(), 3U);
  EXPECT_EQ(pairs.front().second, 5U);
  std::set<std::size_t> points;
  for (const SightedPair& pair : pairs) points.insert({pair.first, pair.second});
  EXPECT_EQ(points.size(), 6U);
}

}  // namespace
}  // namespace trundle::slam
