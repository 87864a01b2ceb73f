#include "trundle/slam/localization/pose_fit.hpp"

#include <vector>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

constexpr double kSigma_m = 0.1;

/// Landmarks around a body at a pose, as it sees them and as a map has them: both err.
std::vector<PointMatch> matches_from(const Pose2& map_from_body, int count, Random& random) {
  std::vector<PointMatch> matches;
  const Matrix2 covariance = kSigma_m * kSigma_m * Matrix2::Identity();
  for (int i = 0; i < count; ++i) {
    const Vector2 there(random.uniform(-10.0, 10.0), random.uniform(-10.0, 10.0));
    const auto noisy = [&](const Vector2& place) {
      return Vector2(place + Vector2(random.normal(kSigma_m), random.normal(kSigma_m)));
    };
    matches.push_back({noisy(there), covariance, noisy(map_from_body * there), covariance});
  }
  return matches;
}

Pose2 anywhere(Random& random) {
  return {random.uniform(-50.0, 50.0), random.uniform(-50.0, 50.0), random.uniform(-kPi, kPi)};
}

TEST(PoseFit, CovarianceAndMisfitAreThoseOfTheErrors) {
  Random random(5);
  constexpr int kTrials = 2000;
  double nees = 0.0, misfit = 0.0, freedom = 0.0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Pose2 truth = anywhere(random);
    const int matches = 3 + trial % 4;
    const auto fit = fit_pose(matches_from(truth, matches, random));
    ASSERT_TRUE(fit);
    const Pose2& pose = fit->map_from_body;
    const Vector3 error(pose.x - truth.x, pose.y - truth.y, wrap_angle(pose.heading - truth.heading));
    nees += error.dot(fit->covariance.inverse() * error) / kTrials;
    misfit += fit->misfit / kTrials;
    freedom += (2.0 * matches - 3.0) / kTrials;
  }
  EXPECT_NEAR(nees, 3.0, 0.22);  // 4 σ of a mean of χ²₃ over all trials
  EXPECT_NEAR(misfit, freedom, 0.31);
}

TEST(PoseFit, ASurerMatchCountsMore) {
  // Two of three landmarks determine the pose; the third, known to 10 m, is wrong by a metre.
  std::vector<PointMatch> matches;
  for (const Vector2& place : {Vector2(5.0, 0.0), Vector2(-5.0, 1.0), Vector2(0.0, 6.0)})
    matches.push_back({place, 1e-4 * Matrix2::Identity(), place, Matrix2::Zero()});
  matches[2].in_map += Vector2(1.0, 0.0);
  matches[2].in_map_covariance = 100.0 * Matrix2::Identity();
  const auto fit = fit_pose(matches);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->map_from_body.translation().norm(), 1e-4);
}

TEST(PoseFit, NeedsTwoMatches) {
  Random random(4);
  EXPECT_FALSE(fit_pose({}));
  EXPECT_FALSE(fit_pose(matches_from({}, 1, random)));
  EXPECT_TRUE(fit_pose(matches_from({}, 2, random)));
}

}  // namespace
}  // namespace trundle::slam
