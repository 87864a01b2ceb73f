#include "trundle/slam/association/landmark_grid.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

TEST(LandmarkGrid, FindsWhatLookingAtAllFinds) {
  Random random(5);
  LandmarkGrid grid(2.5);
  std::vector<Vector2> places;
  std::vector<bool> is_there;
  const auto somewhere = [&] { return Vector2(random.uniform(-40.0, 40.0), random.uniform(-40.0, 40.0)); };
  for (std::size_t i = 0; i < 300; ++i) {
    places.push_back(somewhere());
    is_there.push_back(true);
    grid.put(i, places[i]);
  }
  std::vector<std::size_t> found;
  for (int run = 0; run < 500; ++run) {
    const std::size_t one = random.below(300);
    is_there[one] = run % 3 != 0;
    places[one] = somewhere();
    if (is_there[one])
      grid.put(one, places[one]);
    else
      grid.remove(one);
    const Vector2 centre = somewhere();
    const double radius = random.uniform(0.0, run % 10 == 0 ? 200.0 : 10.0);
    std::vector<std::size_t> expected;
    for (std::size_t i = 0; i < 300; ++i)
      if (is_there[i] && (places[i] - centre).norm() <= radius) expected.push_back(i);
    std::ranges::sort(expected, {}, [&](std::size_t i) { return (places[i] - centre).norm(); });
    grid.near(centre, radius, 300, found);
    ASSERT_EQ(found, expected);
    grid.near(centre, radius, 3, found);
    expected.resize(std::min<std::size_t>(3, expected.size()));
    ASSERT_EQ(found, expected);
  }
}

TEST(LandmarkGrid, IsNotLostFarAway) {
  LandmarkGrid grid(1.0);
  grid.put(0, {1e12, -1e12});
  std::vector<std::size_t> found;
  grid.near({1e12, -1e12}, 10.0, 5, found);
  EXPECT_EQ(found, (std::vector<std::size_t>{0}));
  grid.near({0.0, 0.0}, 1e15, 5, found);
  EXPECT_EQ(found.size(), 1U);
}

}  // namespace
}  // namespace trundle::slam
