#include "trundle/slam/models/observation.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace trundle::slam {
namespace {

const Pose2 kMount{0.219, -0.1, 0.4};

std::vector<Pose2> poses() {
  return {{0.0, 0.0, 0.0}, {1.0, -2.0, 3.1}, {-3.0, 0.5, -9.0}, {0.2, 0.1, 50.0}};
}

/// Central differences of f, a function of a small change of n numbers.
template <int n, class F>
Eigen::Matrix<double, 2, n> numeric_derivative(F f) {
  constexpr double h = 1e-6;
  Eigen::Matrix<double, 2, n> J;
  for (int i = 0; i < n; ++i) {
    Eigen::Matrix<double, n, 1> change = Eigen::Matrix<double, n, 1>::Zero();
    change[i] = h;
    const Vector2 up = f(change);
    const Vector2 down = f(-change);
    J.col(i) = (up - down) / (2.0 * h);
  }
  return J;
}

Pose2 changed(const Pose2& pose, const Vector3& by) {
  return {pose.x + by.x(), pose.y + by.y(), pose.heading + by.z()};
}

TEST(Observation, ExpectationIsWhatTheFramesSay) {
  for (const Pose2& pose : poses()) {
    const Vector2 in_sensor(1.5, -0.7);
    const ExpectedReading expected = expected_reading(pose, kMount, pose * kMount * in_sensor);
    EXPECT_NEAR(expected.range_m, in_sensor.norm(), 1e-12);
    EXPECT_NEAR(expected.bearing_rad, std::atan2(-0.7, 1.5), 1e-12);
  }
}

TEST(Observation, WhatASensorErrsByIsTakenOutExactly) {
  LandmarkSensor sensor;
  sensor.range_offset_m = 0.04;
  sensor.range_scale = 1.02;
  sensor.bearing_offset_rad = 0.03;
  for (const double share : {-0.5, 0.0, 0.7, 1.0}) {
    sensor.depth_share = share;
    for (const double bearing : {-1.2, -0.3, 0.0, 0.6}) {
      const double read = bearing + 0.03;
      const Observation seen =
          observation_of(sensor, 3, 1.02 * 2.5 * (1.0 - share + share * std::cos(read)) + 0.04, read);
      EXPECT_NEAR(seen.range_m, 2.5, 1e-12);
      EXPECT_NEAR(seen.bearing_rad, bearing, 1e-12);
    }
  }
}

TEST(Observation, BehindACameraThereIsNoDepth) {
  LandmarkSensor sensor;
  sensor.depth_share = 1.0;
  EXPECT_FALSE(is_valid(observation_of(sensor, 0, 1.0, 2.0)));
  EXPECT_TRUE(is_valid(observation_of(sensor, 0, 1.0, 1.5)));
}

TEST(Observation, DerivativesAgreeWithDifferences) {
  const Vector2 landmark(2.0, 3.0);
  for (const Pose2& pose : poses()) {
    const ExpectedReading at = expected_reading(pose, kMount, landmark);
    const auto change_of = [&](const Pose2& p, const Vector2& m) {
      const ExpectedReading moved = expected_reading(p, kMount, m);
      return Vector2(moved.range_m - at.range_m, wrap_angle(moved.bearing_rad - at.bearing_rad));
    };
    const Matrix23 by_pose =
        numeric_derivative<3>([&](const Vector3& c) { return change_of(changed(pose, c), landmark); });
    const Matrix2 by_landmark =
        numeric_derivative<2>([&](const Vector2& c) { return change_of(pose, landmark + c); });
    EXPECT_LT((at.by_pose - by_pose).norm(), 1e-8);
    EXPECT_LT((at.by_landmark - by_landmark).norm(), 1e-8);
  }
}

TEST(Observation, InverseAndItsDerivatives) {
  const Observation observation{0, 2.5, -2.0};
  for (const Pose2& pose : poses()) {
    const SightedLandmark at = sighted_landmark(pose, kMount, observation);
    const ExpectedReading back = expected_reading(pose, kMount, at.in_world);
    EXPECT_LT(innovation_of(observation, back).norm(), 1e-12);
    const Matrix23 by_pose = numeric_derivative<3>([&](const Vector3& c) -> Vector2 {
      return sighted_landmark(changed(pose, c), kMount, observation).in_world;
    });
    const Matrix2 by_reading = numeric_derivative<2>([&](const Vector2& c) -> Vector2 {
      return sighted_landmark(pose, kMount, {0, 2.5 + c.x(), -2.0 + c.y()}).in_world;
    });
    EXPECT_LT((at.by_pose - by_pose).norm(), 1e-8);
    EXPECT_LT((at.by_reading - by_reading).norm(), 1e-8);
  }
}

TEST(Observation, ALandmarkBehindIsNoSpecialCase) {
  // On both sides of ±180°, and whole turns away: the innovation is the small angle between them.
  const ExpectedReading behind = expected_reading({0.0, 0.0, 6.0 * kPi}, {}, {-2.0, 1e-3});
  EXPECT_NEAR(std::abs(behind.bearing_rad), kPi, 1e-3);
  for (const double turns : {-2.0, 0.0, 1.0}) {
    const Observation other_side{0, 2.0, -kPi + 1e-3 + turns * 2.0 * kPi};
    EXPECT_NEAR(innovation_of(other_side, behind).y(), 1e-3 + 5e-4, 1e-6);
  }
}

TEST(Observation, OnTopOfTheSensorGivesNumbers) {
  const ExpectedReading expected = expected_reading({1.0, 2.0, 0.3}, {}, {1.0, 2.0});
  EXPECT_TRUE(expected.by_pose.allFinite() && expected.by_landmark.allFinite());
}

TEST(Observation, Validity) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(is_valid({0, 1.0, 9.0}));
  for (const Observation& wrong :
       {Observation{0, -1.0, 0.0}, Observation{0, 0.0, 0.0}, Observation{0, kNan, 0.0},
        Observation{0, 1.0, kNan}, Observation{0, kInfinite, 0.0}, Observation{0, 1.0, kInfinite}})
    EXPECT_FALSE(is_valid(wrong));
}

}  // namespace
}  // namespace trundle::slam
