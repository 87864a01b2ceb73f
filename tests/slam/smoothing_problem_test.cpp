#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

constexpr double kStep = 1e-6;

Pose2 any_pose(Random& random) {
  return {random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0), random.uniform(-9.0, 9.0)};
}

Pose2 nudged(const Pose2& pose, int coordinate, double by) {
  Vector3 delta = Vector3::Zero();
  delta[coordinate] = by;
  return pose * exp(Twist2::from(delta));
}

TEST(MotionResidual, DerivativesAreThoseOfSmallMoves) {
  Random random(1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    MotionLink link;
    link.mean = exp({random.uniform(-2.0, 2.0), random.uniform(-1.0, 1.0), random.uniform(-2.5, 2.5)});
    link.by_parameters = Eigen::Matrix3Xd::Random(3, 2);
    link.by_bias = Vector3::Random();
    link.from = 0;
    link.to = 1;
    const Eigen::Vector2d p(random.normal(0.1), random.normal(0.1));
    const Pose2 a = any_pose(random);
    const Pose2 b = a * link.mean * exp({random.normal(0.3), random.normal(0.3), random.normal(0.3)});
    const SmoothingState here{{a, b}, {}, p, {0.1, -0.2}};
    const MotionResidual r = motion_residual(link, here);
    const auto error = [&](std::size_t pose, int i, double by) {
      SmoothingState there = here;
      if (i < 3)
        there.poses[pose] = nudged(here.poses[pose], i, by);
      else
        there.biases[pose] += by;
      return motion_residual(link, there).error;
    };
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector4d by_a = (error(0, i, kStep) - error(0, i, -kStep)) / (2.0 * kStep);
      const Eigen::Vector4d by_b = (error(1, i, kStep) - error(1, i, -kStep)) / (2.0 * kStep);
      EXPECT_LT((by_a - r.by_from.col(i)).norm(), 1e-7);
      EXPECT_LT((by_b - r.by_to.col(i)).norm(), 1e-7);
    }
  }
}

TEST(SightingResidual, DerivativesAreThoseOfSmallMoves) {
  const LandmarkSensor sensor{{0.2, -0.1, 0.7}, 0.1, 0.02, 10.0, 0.0};
  Random random(2, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const Pose2 pose = any_pose(random);
    const Vector2 landmark(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0));
    const Observation observation{0, 3.0, random.uniform(-kPi, kPi)};
    const auto error = [&](const Pose2& from, const Vector2& of) -> Vector2 {
      return sighting_residual(sensor, observation, from, of).error;
    };
    const SightingResidual r = sighting_residual(sensor, observation, pose, landmark);
    const double tolerance = 1e-6 * (1.0 + r.by_pose.norm());
    for (int i = 0; i < 3; ++i) {
      const Vector2 by_pose =
          (error(nudged(pose, i, kStep), landmark) - error(nudged(pose, i, -kStep), landmark)) /
          (2.0 * kStep);
      EXPECT_LT((by_pose - r.by_pose.col(i)).norm(), tolerance);
    }
    for (int i = 0; i < 2; ++i) {
      const Vector2 nudge = kStep * Vector2::Unit(i);
      const Vector2 by_landmark =
          (error(pose, landmark + nudge) - error(pose, landmark - nudge)) / (2.0 * kStep);
      EXPECT_LT((by_landmark - r.by_landmark.col(i)).norm(), tolerance);
    }
  }
}

TEST(SightingResidual, DerivativesByTheSensorAreThoseOfSmallErrors) {
  LandmarkSensor sensor{{0.2, -0.1, 0.7}, 0.1, 0.02, 10.0, 0.0};
  Random random(3, 1);
  for (int trial = 0; trial < 50; ++trial) {
    sensor.depth_share = 0.1 * (trial % 5);
    const Pose2 pose = any_pose(random);
    const Vector2 landmark(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0));
    const Observation observation{0, 3.0, random.uniform(-kPi, kPi)};
    SensorErrors here;
    for (double& error : here) error = random.normal(0.05);
    const SightingResidual r = sighting_residual(sensor, observation, pose, landmark, here);
    for (int i = 0; i < here.size(); ++i) {
      const SensorErrors step = kStep * SensorErrors::Unit(i);
      const Vector2 slope = (sighting_residual(sensor, observation, pose, landmark, here + step).error -
                             sighting_residual(sensor, observation, pose, landmark, here - step).error) /
                            (2.0 * kStep);
      EXPECT_LT((slope - r.by_sensor.col(i)).norm(), 1e-6 * (1.0 + r.by_sensor.norm())) << i;
    }
  }
}

// To first order, errors beside a robot file are those of another robot file.
TEST(SightingResidual, ErrorsBesideTheRobotFileAreThoseOfAnother) {
  LandmarkSensor sensor{{0.2, -0.1, 0.7}, 0.1, 0.02, 10.0, 0.0};
  sensor.bearing_offset_rad = 0.05;
  sensor.depth_share = 0.8;
  Random random(4, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const Pose2 pose = any_pose(random);
    const Vector2 landmark(random.uniform(-5.0, 5.0), random.uniform(-5.0, 5.0));
    LandmarkSensor other = sensor;
    other.range_offset_m += kStep;
    other.depth_share += 2.0 * kStep;
    other.bearing_offset_rad -= kStep;
    SensorErrors beside = SensorErrors::Zero();
    beside[0] = kStep;
    beside[2] = -kStep;
    beside[5] = 2.0 * kStep;
    // Asked where residuals vanish: a share of a reading is one of the distance there.
    const ExpectedReading seen = expected_reading(pose, sensor.body_from_sensor, landmark);
    const double read_rad = seen.bearing_rad + sensor.bearing_offset_rad;
    const double read_m = seen.range_m * sensor.along_ray(read_rad);
    if (read_m <= 0.0) continue;
    const auto exact = [&](const LandmarkSensor& by, const SensorErrors& errors) {
      return sighting_residual(by, observation_of(by, 0, read_m, read_rad), pose, landmark, errors).error;
    };
    const Vector2 by_file = exact(other, SensorErrors::Zero()) - exact(sensor, SensorErrors::Zero());
    const Vector2 by_errors = exact(sensor, beside) - exact(sensor, SensorErrors::Zero());
    EXPECT_LT((by_file - by_errors).norm(), 1e-3 * by_file.norm());
  }
}

TEST(FreeMotion, ComposesAsMotionsDo) {
  const Motion a = motion_of({0.5, 0.1, 0.4}, Matrix3::Identity() * 0.01);
  const Motion b = motion_of({0.3, -0.1, -0.7}, Matrix3::Identity() * 0.02);
  const Motion whole = a * b;
  const FreeMotion free =
      FreeMotion{a.mean, a.covariance, a.by_systematic} * FreeMotion{b.mean, b.covariance, b.by_systematic};
  EXPECT_LT((free.covariance - whole.covariance).norm(), 1e-15);
  EXPECT_LT((free.by_parameters - whole.by_systematic).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(free.mean.x, whole.mean.x);
}

TEST(RobustCost, IsSmoothAtTheGateAndHasItsWeightForDerivative) {
  const double gate = 9.0;
  for (const double s : {0.5, 8.999, 9.001, 30.0, 1e4}) {
    const double slope = (robust_cost(s + 1e-6, gate) - robust_cost(s - 1e-6, gate)) / 2e-6;
    EXPECT_NEAR(slope, robust_weight(s, gate), 1e-4);
  }
}

}  // namespace
}  // namespace trundle::slam
