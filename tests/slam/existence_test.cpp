#include "trundle/slam/association/existence.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trundle::slam {
namespace {

/// A camera of ±30° and 8 m that has seen a lot.
Visibility camera() {
  Visibility view(10.0);
  for (int k = 0; k < 40; ++k)
    for (int degree = -30; degree <= 30; degree += 5) view.add_seen(2.0 + 0.15 * k, radians(degree));
  return view;
}

/// At a landmark 4 m ahead.
Existence::ExpectedSighting sighting_from(double x, bool seen) {
  return {.from = {x, 0.0}, .range_m = 4.0, .bearing_rad = 0.0, .seen = seen};
}

TEST(Visibility, IsWhatHasBeenSeen) {
  const Visibility view = camera();
  EXPECT_TRUE(view.covers(5.0, 0.0));
  EXPECT_TRUE(view.covers(5.0, radians(15.0)));
  EXPECT_TRUE(view.covers(7.8, 0.0));
  EXPECT_FALSE(view.covers(7.9, 0.0));
  EXPECT_FALSE(view.covers(5.0, radians(35.0)));
  EXPECT_FALSE(view.covers(5.0, kPi));
  EXPECT_FALSE(Visibility(10.0).covers(1.0, 0.0));
}

TEST(Visibility, SeesAllAroundAcrossTheWrap) {
  Visibility view(10.0);
  for (int k = 0; k < 20; ++k)
    for (int degree = -175; degree <= 175; degree += 5) view.add_seen(9.0, radians(degree));
  EXPECT_TRUE(view.covers(5.0, kPi));
  EXPECT_TRUE(view.covers(5.0, -kPi));
  EXPECT_TRUE(view.covers(5.0, radians(179.0)));
}

TEST(Existence, AVanishedLandmarkIsRemovedAndAnOccludedOneIsNot) {
  Visibility view = camera();
  Existence landmark;
  double x = 0.0;
  const auto update = [&](bool seen) {
    x += 0.5;
    return landmark.update(sighting_from(x, seen), view);
  };
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(update(true));
  EXPECT_TRUE(update(false));
  EXPECT_TRUE(update(false));  // occluded for a moment
  for (int k = 0; k < 4; ++k) ASSERT_TRUE(update(true));
  int updates = 0;
  while (update(false)) ASSERT_LT(++updates, 12);
  EXPECT_GE(updates, 3);
}

TEST(Existence, ASpuriousOneGoesSoonerThanAnOldOne) {
  Visibility view = camera();
  Existence old, spurious;
  for (int k = 1; k <= 20; ++k) old.update(sighting_from(0.5 * k, true), view);
  const auto updates_until_gone = [&](Existence& landmark) {
    for (int updates = 1;; ++updates)
      if (!landmark.update(sighting_from(20.0 + updates, false), view)) return updates;
  };
  const int of_spurious = updates_until_gone(spurious);
  EXPECT_LE(of_spurious, 3);
  EXPECT_LT(of_spurious, updates_until_gone(old));
}

TEST(Existence, OneIsToldOnceItIsSurelyThere) {
  Visibility view = camera();
  Existence landmark;
  EXPECT_FALSE(landmark.is_confirmed(view));
  for (int k = 0; k < 10; ++k) landmark.update(sighting_from(0.0, true), view);  // standing still
  EXPECT_FALSE(landmark.is_confirmed(view));
  int updates = 0;
  while (!landmark.is_confirmed(view)) landmark.update(sighting_from(++updates, true), view);
  EXPECT_GE(updates, 2);
  EXPECT_LE(updates, 3);
}

TEST(Existence, WhereMostNewOnesTurnOutToBeNoneOneIsToldLater) {
  Visibility view = camera();
  Existence landmark;
  for (int k = 1; k <= 2; ++k) landmark.update(sighting_from(k, true), view);
  ASSERT_TRUE(landmark.is_confirmed(view));
  for (int k = 0; k < 40; ++k) view.resolve(false);
  EXPECT_FALSE(landmark.is_confirmed(view));
  for (int k = 0; k < 5; ++k) landmark.update(sighting_from(3.0 + k, true), view);
  EXPECT_TRUE(landmark.is_confirmed(view));
}

TEST(Existence, StandingStillIsOneLook) {
  const Existence landmark{.log_odds = 3.0, .last_viewpoint = {1.0, 1.0}};
  EXPECT_FALSE(landmark.has_parallax({1.0, 1.1}, 5.0));
  EXPECT_TRUE(landmark.has_parallax({1.0, 2.0}, 5.0));
}

TEST(Existence, ASensorThatMissesMostSaysLittleByIt) {
  Visibility poor = camera();
  Visibility good = camera();
  for (int k = 0; k < 100; ++k) {
    poor.count(4.0, 0.0, k % 5 == 0);
    good.count(4.0, 0.0, true);
  }
  EXPECT_GT(poor.for_missed(4.0, 0.0), 0.3 * good.for_missed(4.0, 0.0));
  EXPECT_LT(poor.for_missed(4.0, 0.0), 0.0);
  EXPECT_GT(poor.for_seen(4.0, 0.0), 0.0);
}

TEST(Existence, LandmarksAtTheEdgeOfTheViewMayBeMissed) {
  Visibility view = camera();
  for (int k = 0; k < 100; ++k) {
    view.count(1.0, 0.0, true);
    view.count(7.5, 0.0, k % 10 == 0);
  }
  EXPECT_LT(view.for_missed(1.0, 0.0), -1.0);
  EXPECT_GT(view.for_missed(7.5, 0.0), -0.1);
}

TEST(Visibility, TheEdgeIsWhereItIsInThatDirection) {
  Visibility view(10.0);  // twice as far ahead as behind
  for (int k = 0; k < 20; ++k)
    for (int degree = -175; degree <= 175; degree += 5)
      view.add_seen(std::abs(degree) < 90 ? 8.0 : 4.0, radians(degree));
  for (int k = 0; k < 100; ++k) view.count(7.8, 0.0, false);
  EXPECT_GT(view.for_missed(3.9, kPi), -0.1);
  EXPECT_LT(view.for_missed(3.9, 0.0), -0.5);
}

TEST(Existence, OneMissedBesideANeighbourThatWasSeenMayBeThere) {
  Visibility poor = camera();
  Visibility good = camera();
  for (int k = 0; k < 100; ++k) {
    poor.count(4.0, 0.0, k % 2 == 0);
    good.count(4.0, 0.0, true);
  }
  EXPECT_LT(poor.for_missed(4.0, 0.0), -0.5);
  EXPECT_EQ(poor.for_missed(4.0, 0.0, true), 0.0);
  EXPECT_NEAR(good.for_missed(4.0, 0.0, true), good.for_missed(4.0, 0.0) + std::log(2.0), 1e-12);
}

TEST(Existence, WhatWasNeverConfirmedTeachesNothing) {
  Visibility view = camera();
  for (int k = 0; k < 40; ++k) view.resolve(false);
  Existence phantom;
  phantom.update(sighting_from(1.0, true), view);
  ASSERT_GT(phantom.log_odds, Existence::kLikely);
  ASSERT_FALSE(phantom.is_confirmed(view));
  const double before = view.for_missed(4.0, 0.0);
  phantom.update(sighting_from(2.0, false), view);
  EXPECT_EQ(view.for_missed(4.0, 0.0), before);
  Existence landmark;
  for (int k = 1; k < 6; ++k) landmark.update(sighting_from(k, true), view);
  ASSERT_TRUE(landmark.is_confirmed(view));
  landmark.update(sighting_from(7.0, false), view);
  EXPECT_NE(view.for_missed(4.0, 0.0), before);
}

}  // namespace
}  // namespace trundle::slam
