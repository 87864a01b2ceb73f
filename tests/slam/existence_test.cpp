#include "trundle/slam/association/existence.hpp"

#include <gtest/gtest.h>

namespace trundle {
namespace {

/// A camera of ±30° and 8 m that has seen a lot.
Visibility camera() {
  Visibility view(10.0);
  for (int k = 0; k < 40; ++k)
    for (int degree = -30; degree <= 30; degree += 5) view.saw(2.0 + 0.15 * k, radians(degree));
  return view;
}

TEST(Visibility, IsWhatHasBeenSeenWithAMargin) {
  const Visibility view = camera();
  EXPECT_TRUE(view.covers(5.0, 0.0));
  EXPECT_TRUE(view.covers(5.0, radians(15.0)));
  EXPECT_FALSE(view.covers(7.5, 0.0));
  EXPECT_FALSE(view.covers(5.0, radians(35.0)));
  EXPECT_FALSE(view.covers(5.0, kPi));
  EXPECT_FALSE(Visibility(10.0).covers(1.0, 0.0));
}

TEST(Visibility, SeesAllAroundAcrossTheWrap) {
  Visibility view(10.0);
  for (int k = 0; k < 20; ++k)
    for (int degree = -175; degree <= 175; degree += 5) view.saw(9.0, radians(degree));
  EXPECT_TRUE(view.covers(5.0, kPi));
  EXPECT_TRUE(view.covers(5.0, -kPi));
  EXPECT_TRUE(view.covers(5.0, radians(179.0)));
}

TEST(Existence, AVanishedLandmarkIsRemovedAndAnOccludedOneIsNot) {
  Visibility view = camera();
  Existence landmark;
  double x = 0.0;
  const auto look = [&](bool seen) {
    x += 0.5;
    return landmark.look({x, 0.0}, seen, view);
  };
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(look(true));
  EXPECT_TRUE(look(false));
  EXPECT_TRUE(look(false));  // occluded for a moment
  for (int k = 0; k < 4; ++k) ASSERT_TRUE(look(true));
  int looks = 0;
  while (look(false)) ASSERT_LT(++looks, 12);
  EXPECT_GE(looks, 3);
}

TEST(Existence, ASpuriousOneGoesSoonerThanAnOldOne) {
  Visibility view = camera();
  Existence old, spurious;
  for (int k = 0; k < 20; ++k) old.look({0.5 * k, 0.0}, true, view);
  int looks = 0;
  while (spurious.look({}, false, view)) ++looks;
  EXPECT_LE(looks, 3);
  while (old.look({}, false, view)) --looks;
  EXPECT_LT(looks, 0);
}

TEST(Existence, StandingStillIsOneLook) {
  const Existence landmark{.log_odds = 3.0, .looked_from = {1.0, 1.0}};
  EXPECT_FALSE(landmark.is_another_look({1.0, 1.1}, 5.0));
  EXPECT_TRUE(landmark.is_another_look({1.0, 2.0}, 5.0));
}

TEST(Existence, ASensorThatMissesMostSaysLittleByIt) {
  Visibility poor = camera();
  Visibility good = camera();
  for (int k = 0; k < 100; ++k) {
    poor.count(k % 5 == 0);
    good.count(true);
  }
  EXPECT_GT(poor.for_missed(), 0.3 * good.for_missed());
  EXPECT_LT(poor.for_missed(), 0.0);
  EXPECT_GT(poor.for_seen(), 0.0);
}

}  // namespace
}  // namespace trundle
