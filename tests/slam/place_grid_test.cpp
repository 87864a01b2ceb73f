#include "trundle/slam/localization/place_grid.hpp"

#include <algorithm>
#include <limits>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

std::vector<std::size_t> by_grid(const PlaceGrid& grid, const Vector2& centre, double radius_m) {
  std::vector<std::size_t> found;
  grid.visit_until(centre, radius_m, [&](std::size_t number) {
    found.push_back(number);
    return false;
  });
  std::ranges::sort(found);
  return found;
}

std::vector<std::size_t> by_looking_at_all(const std::vector<Vector2>& places, const Vector2& centre,
                                           double radius_m) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < places.size(); ++i)
    if ((places[i] - centre).squaredNorm() <= radius_m * radius_m) found.push_back(i);
  return found;
}

/// Places that fill an area, lie along a line, in clusters, or all in one.
std::vector<Vector2> places_laid_out(int kind, Random& random) {
  std::vector<Vector2> places;
  const std::size_t count = 1 + random.below(200);
  for (std::size_t i = 0; i < count; ++i) {
    const Vector2 at(random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0));
    if (kind == 0) places.push_back(at);
    if (kind == 1) places.push_back({at.x(), 7.0});
    if (kind == 2) places.push_back((at / 25.0).array().round() * 1e6 + at.array() / 100.0);
    if (kind == 3) places.push_back({1.0, -2.0});
  }
  return places;
}

TEST(PlaceGrid, FindsWhatALookAtAllOfThemFinds) {
  Random random(1, 2);
  for (int trial = 0; trial < 400; ++trial) {
    const std::vector<Vector2> places = places_laid_out(trial % 4, random);
    const PlaceGrid grid(places);
    for (int look = 0; look < 20; ++look) {
      const Vector2 centre =
          places[random.below(places.size())] + Vector2(random.normal(10.0), random.normal(10.0));
      const double radius_m = random.uniform(0.0, 40.0);
      const auto expected = by_looking_at_all(places, centre, radius_m);
      ASSERT_EQ(by_grid(grid, centre, radius_m), expected) << trial;
      EXPECT_EQ(grid.count_within(centre, radius_m), expected.size());
      EXPECT_EQ(grid.has_any_within(centre, radius_m), !expected.empty());
    }
  }
}

TEST(PlaceGrid, HasNothingWhereThereIsNoPlace) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const std::vector<Vector2> places = {{0.0, 0.0}, {1e308, -1e308}, {5.0, 3.0}};
  const PlaceGrid grid(places);
  EXPECT_FALSE(grid.has_any_within({kNan, 0.0}, 10.0));
  EXPECT_FALSE(grid.has_any_within({0.0, 0.0}, kNan));
  EXPECT_FALSE(grid.has_any_within({kInf, -kInf}, 10.0));
  EXPECT_EQ(grid.count_within({4.0, 3.0}, 10.0), 2U);
}

}  // namespace
}  // namespace trundle::slam
