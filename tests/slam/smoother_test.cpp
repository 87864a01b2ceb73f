#include "trundle/slam/smoothing/smoother.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/geometry/gaussian.hpp"
#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

#include "scale.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

SlamInput unstamped(const test::SlamWorld& world) {
  SlamInput input;
  input.steps = world.steps;
  return input;
}

/// Log(estimate⁻¹ truth) in its covariance.
double nees_of(const Pose2& estimate, const Matrix3& covariance_in_world, const Pose2& truth) {
  const Vector3 e = log(estimate.inverse() * truth).vector();
  return e.dot(body_covariance(estimate, covariance_in_world).ldlt().solve(e));
}

/// Sightings at every n-th step alone.
void see_every(int n, test::SlamWorld& world) {
  for (std::size_t k = 0; k < world.steps.size(); ++k)
    if (static_cast<int>(k + 1) % n != 0) world.steps[k].observations.clear();
}

// In the mean: what the first sightings err by turns the map, and no later one turns it back.
TEST(Smoother, IsCloserToTheTruthThanItsFilter) {
  double of_filter = 0.0, of_smoother = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const test::SlamWorld world = test::slam_world({.steps = 400, .seed = seed});
    const SlamInput input = unstamped(world);
    const SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::fastslam2, .particles = 30});
    const SmoothedSlam smoothed = smooth(input, world.sensor, filtered);
    EXPECT_TRUE(smoothed.counts.converged) << seed;
    of_filter += std::pow(test::position_rms(*filtered.path, world.truth), 2);
    of_smoother += std::pow(test::position_rms(smoothed.trajectory, world.truth), 2);
  }
  EXPECT_LT(of_smoother, 0.8 * of_filter);
}

/// Seen at every fifth step; the odometry's systematic errors drawn with these sigmas.
test::SlamWorld world_with_errors(int trial, const Vector3& sigma) {
  Random random(static_cast<std::uint64_t>(trial), 5);
  test::SlamWorld world = test::slam_world(
      {.steps = 198,
       .landmarks = 12,
       .seed = static_cast<std::uint64_t>(trial) + 1,
       .systematic = {random.normal(sigma[0]), random.normal(sigma[1]), random.normal(sigma[2])}});
  see_every(5, world);
  return world;
}

// Poses at keyframes, between two of them and after the last, and every landmark.
TEST(Smoother, ErrorsAreAsLargeAsItsCovariancesSay) {
  const int trials = test::trials(50, 10);
  const Vector3 sigma(0.01, 0.02, 0.01);
  const std::vector<std::size_t> steps = {20, 61, 99, 100, 150, 197};
  std::vector<double> pose_nees(steps.size());
  double map_nees = 0.0, cost = 0.0;
  int freedom = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const test::SlamWorld world = world_with_errors(trial, sigma);
    const SlamInput input = unstamped(world);
    const SlamPrior prior{.systematic_sigma = sigma};
    const SmoothedSlam smoothed =
        smooth(input, world.sensor,
               slam(input, world.sensor, {.method = SlamMethod::fastslam2, .particles = 50, .prior = prior}),
               {.prior = prior});
    for (std::size_t i = 0; i < steps.size(); ++i)
      pose_nees[i] += nees_of(smoothed.trajectory.poses[steps[i]].pose,
                              smoothed.trajectory.covariances[steps[i]], world.truth[steps[i]]);
    for (const MappedLandmark& landmark : smoothed.map) {
      const Vector2 e = world.landmarks[static_cast<std::size_t>(landmark.id)] - landmark.position;
      map_nees += e.dot(landmark.covariance.ldlt().solve(e)) / static_cast<double>(smoothed.map.size());
    }
    cost += smoothed.counts.cost;
    freedom += smoothed.counts.degrees_of_freedom;
  }
  // 99.9 % of sums of honest ones lie between these.
  const double least = chi_squared_limit(0.9995, 3.0 * trials);
  const double most = chi_squared_limit(0.0005, 3.0 * trials);
  for (const double sum : pose_nees) {
    EXPECT_GT(sum, least);
    EXPECT_LT(sum, most);
  }
  // Landmarks of one run err together, so that their mean scatters less than one of them and no more.
  EXPECT_GT(map_nees, chi_squared_limit(0.9995, 2.0 * trials));
  EXPECT_LT(map_nees, chi_squared_limit(0.0005, 2.0 * trials));
  EXPECT_NEAR(cost / freedom, 1.0, 4.0 * std::sqrt(2.0 / freedom) + 0.002);
}

// The odometry is wrong by 10 % of each turn and the filter is not told: on some seeds it is lost.
TEST(Smoother, FindsTheSameMinimumWhereItsFilterIsLost) {
  int lost = 0;
  for (int trial = 0; trial < test::trials(50, 15); ++trial) {
    const test::SlamWorld world = world_with_errors(trial, kUsualShareSigma);
    const SlamInput input = unstamped(world);
    SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::fastslam2, .particles = 50});
    const SmoothedSlam smoothed = smooth(input, world.sensor, filtered);
    lost += smoothed.counts.starts > 1 ? 1 : 0;
    for (std::size_t k = 0; k < world.truth.size(); ++k) filtered.path->poses[k].pose = world.truth[k];
    const SmoothedSlam from_truth = smooth(input, world.sensor, filtered);
    EXPECT_LE(smoothed.counts.cost, 1.001 * from_truth.counts.cost) << trial;
  }
  EXPECT_GT(lost, 0);
}

// Poses of a robot that never skids are bound to a narrow curved valley of the cost.
TEST(Smoother, NeedsFewStepsWhereTheRobotDoesNotSkid) {
  const test::SlamWorld world = test::slam_world({.steps = 600,
                                                  .landmarks = 60,
                                                  .radius_m = 60.0,
                                                  .step_m = 1.0,
                                                  .sigma_along_m = 0.05,
                                                  .sigma_across_m = 1e-6,
                                                  .sigma_turn_rad = 0.01,
                                                  .seed = 8});
  const SlamInput input = unstamped(world);
  SlamResult blind = slam(input, world.sensor, {.method = SlamMethod::ekf});
  Pose2 pose;
  for (std::size_t k = 0; k < input.steps.size(); ++k)
    blind.online.poses[k].pose = pose = pose * input.steps[k].motion.mean;
  const SmoothedSlam smoothed = smooth(input, world.sensor, blind, {.prior = {}});
  EXPECT_TRUE(smoothed.counts.converged);
  EXPECT_LT(smoothed.counts.iterations, 30);
  for (std::size_t k = 0; k < world.truth.size(); ++k) blind.online.poses[k].pose = world.truth[k];
  EXPECT_LE(smoothed.counts.cost, 1.001 * smooth(input, world.sensor, blind, {.prior = {}}).counts.cost);
}

TEST(Smoother, IsNotPulledByOutliers) {
  test::SlamWorld world = test::slam_world({.steps = 300, .seed = 4});
  const SlamInput clean = unstamped(world);
  const SmoothedSlam expected = smooth(
      clean, world.sensor, slam(clean, world.sensor, {.method = SlamMethod::fastslam2, .particles = 50}));
  Random random(9, 9);
  std::size_t wrong = 0;
  for (SlamStep& step : world.steps)
    for (Observation& seen : step.observations)
      if (random.uniform(0.0, 1.0) < 0.05) {
        seen.bearing_rad = wrap_angle(seen.bearing_rad + random.uniform(0.5, 5.5));
        ++wrong;
      }
  const SlamInput spoilt = unstamped(world);
  const SmoothedSlam smoothed = smooth(
      spoilt, world.sensor, slam(spoilt, world.sensor, {.method = SlamMethod::fastslam2, .particles = 50}));
  EXPECT_GE(smoothed.counts.outliers, wrong);
  EXPECT_LT(smoothed.counts.outliers, wrong + wrong / 4);
  EXPECT_LT(test::position_rms(smoothed.trajectory, world.truth),
            1.3 * test::position_rms(expected.trajectory, world.truth));
}

TEST(Smoother, TakesNothingSeenForNoAnswer) {
  test::SlamWorld world = test::slam_world({.steps = 5});
  for (SlamStep& step : world.steps) step.observations.clear();
  const SlamInput input = unstamped(world);
  const SlamResult filtered = slam(input, world.sensor, {.method = SlamMethod::fastslam2, .particles = 5});
  EXPECT_THROW((void)smooth(input, world.sensor, filtered), CannotAnswer);
}

TEST(Smoother, ReadingsThatAreNoNumbersChangeNothing) {
  test::SlamWorld world = test::slam_world({.steps = 100});
  SlamInput input = unstamped(world);
  const SmoothedSlam expected =
      smooth(input, world.sensor, slam(input, world.sensor, {.method = SlamMethod::ekf}));
  input.steps[50].observations.push_back({3, std::nan(""), 0.1});
  input.steps[51].observations.push_back({4, -1.0, 0.1});
  input.steps[52].observations.push_back({kUnknownLandmark, 2.0, std::numeric_limits<double>::infinity()});
  const SmoothedSlam smoothed =
      smooth(input, world.sensor, slam(input, world.sensor, {.method = SlamMethod::ekf}));
  EXPECT_EQ(smoothed.counts.cost, expected.counts.cost);
}

}  // namespace
}  // namespace trundle::slam
