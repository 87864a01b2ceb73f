#include "trundle/slam/ekf/agreement.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle {
namespace {

constexpr double kSigma_m = 0.1;

/// Landmarks around the robot, seen from a pose that is wrong by `error`.
std::vector<SeenAndMapped> seen_from_elsewhere(int count, const Pose2& error, Random& random) {
  std::vector<SeenAndMapped> landmarks;
  for (int i = 0; i < count; ++i) {
    const Vector2 there(random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0));
    const auto noisy = [&](const Vector2& place) {
      return Vector2(place + Vector2(random.normal(kSigma_m), random.normal(kSigma_m)));
    };
    landmarks.push_back({noisy(error * there), noisy(there), kSigma_m * kSigma_m * Matrix2::Identity()});
  }
  return landmarks;
}

TEST(Agreement, WhatAnyPoseExplainsAgreesButInOneOfAThousand) {
  Random random(1);
  int refused = 0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Pose2 error{random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0), random.uniform(-kPi, kPi)};
    refused += agreed_motion(seen_from_elsewhere(3 + trial % 8, error, random)) ? 0 : 1;
  }
  EXPECT_LE(refused, 13);  // 4 expected; more in one run of 10 000
}

TEST(Agreement, WrongNamesDoNotAgree) {
  Random random(2);
  int agreed = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<SeenAndMapped> landmarks = seen_from_elsewhere(4, {}, random);
    for (SeenAndMapped& l : landmarks) l.seen = {random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0)};
    agreed += agreed_motion(landmarks) ? 1 : 0;
  }
  EXPECT_LE(agreed, 2);
}

TEST(Agreement, OneOutlierAmongManyIsEnoughToWait) {
  Random random(3);
  std::vector<SeenAndMapped> landmarks = seen_from_elsewhere(8, {3.0, -2.0, 0.4}, random);
  ASSERT_TRUE(agreed_motion(landmarks));
  landmarks[2].seen.x() += 2.0;
  EXPECT_FALSE(agreed_motion(landmarks));
}

TEST(Agreement, TwoAreNotEnough) {
  Random random(4);
  EXPECT_FALSE(agreed_motion(seen_from_elsewhere(2, {}, random)).has_value());
  EXPECT_FALSE(agreed_motion({}));
}

}  // namespace
}  // namespace trundle
