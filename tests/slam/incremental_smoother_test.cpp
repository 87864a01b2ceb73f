// The smoother that goes along, against the batch over everything so far, and against the truth.
#include "trundle/slam/smoothing/incremental_smoother.hpp"

#include <cmath>
#include <set>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/io/archive.hpp"
#include "trundle/slam/ekf/ekf.hpp"
#include "trundle/slam/slam.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/statistics/distribution.hpp"

#include "scale.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

using Eigen::MatrixXd;
using test::slam_world;
using test::SlamWorld;

Vector3 error_of(const Pose2& estimate, const Pose2& truth) {
  return {estimate.x - truth.x, estimate.y - truth.y, wrap_angle(estimate.heading - truth.heading)};
}

double in_sigmas(const Vector3& error, const Matrix3& covariance) {
  return std::sqrt(error.dot(covariance.ldlt().solve(error)));
}

/// How far estimates are from the batch over everything so far: each must be below half a sigma, their mean
/// below a tenth.
class AgainstBatch {
 public:
  void add(const IncrementalSmoother& smoother) {
    const PoseEstimate online = smoother.estimate();
    Minimiser batch(smoother.problem());
    const Minimum minimum = batch.minimise(smoother.problem(), smoother.state(), {.enough = 1e-9});
    ASSERT_TRUE(minimum.converged);
    ASSERT_TRUE(batch.linearise(smoother.problem(), minimum.state));
    const int last = smoother.problem().poses - 1;
    const GaussianPose pose{minimum.state.poses.back(), batch.pose_covariance(last).topLeftCorner<3, 3>()};
    const Matrix3 covariance = world_covariance(pose);
    const double off = in_sigmas(error_of(online.pose, pose.mean), covariance);
    EXPECT_LT(off, 0.5);
    EXPECT_LT((online.covariance - covariance).norm(), 0.1 * covariance.norm());
    sum_ += off;
    ++count_;
  }
  ~AgainstBatch() { EXPECT_LT(sum_ / count_, 0.1); }

 private:
  double sum_ = 0.0;
  int count_ = 0;
};

TEST(IncrementalSmoother, IsTheBatchOverEverythingSoFar) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    // A loop and a half: 63 steps make one.
    const SlamWorld world = slam_world({.steps = 100, .seed = seed});
    IncrementalSmoother smoother(world.sensor, {});
    AgainstBatch against_batch;
    for (std::size_t k = 0; k < world.steps.size(); ++k) {
      smoother.step(world.steps[k].motion, world.steps[k].observations);
      if (k % 9 == 8 && !world.steps[k].observations.empty()) against_batch.add(smoother);
    }
  }
}

TEST(IncrementalSmoother, EstimatesSystematicErrorsAsTheBatchDoes) {
  const SlamWorld world = slam_world({.steps = 150, .seed = 4, .systematic = {0.03, -0.05, 0.02}});
  IncrementalSmoother smoother(world.sensor, {.prior = {.systematic_sigma = Systematic::Constant(3, 0.05)}});
  AgainstBatch against_batch;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    smoother.step(world.steps[k].motion, world.steps[k].observations);
    if (k % 25 == 24) against_batch.add(smoother);
  }
  const PoseEstimate last = smoother.estimate();
  const Vector3 off = last.systematic - Vector3(0.03, -0.05, 0.02);
  EXPECT_LT(off.dot(Matrix3(last.systematic_covariance).ldlt().solve(off)), 16.3);  // 99.9 % of χ²₃
}

// Between sightings the estimate is the last one's, moved on: at the next one nothing may jump but by its
// noise.
TEST(IncrementalSmoother, GoesOnWithoutSightings) {
  SlamWorld world = slam_world({.steps = 90, .seed = 6});
  for (std::size_t k = 30; k < 60; ++k) world.steps[k].observations.clear();
  IncrementalSmoother smoother(world.sensor, {});
  for (std::size_t k = 0; k < 60; ++k) smoother.step(world.steps[k].motion, world.steps[k].observations);
  const PoseEstimate blind = smoother.estimate();
  EXPECT_LT(in_sigmas(error_of(blind.pose, world.truth[59]), blind.covariance), 4.0);
  for (std::size_t k = 60; k < 90; ++k) smoother.step(world.steps[k].motion, world.steps[k].observations);
  EXPECT_LT(smoother.estimate().covariance.trace(), blind.covariance.trace());
}

// Until something is seen there is nothing to smooth: it is what any filter knows.
TEST(IncrementalSmoother, StartsFromItsPrior) {
  const SlamWorld world = slam_world({.steps = 20, .seed = 7});
  SlamPrior prior{.systematic_sigma = Systematic::Constant(3, 0.05)};
  prior.start_covariance = Vector3(0.01, 0.02, 0.003).asDiagonal();
  IncrementalSmoother smoother(world.sensor, {.prior = prior});
  EkfSlam ekf(world.sensor, {.prior = prior});
  for (const SlamStep& step : world.steps) {
    smoother.step(step.motion, {});
    ekf.step(step.motion, {});
  }
  const PoseEstimate ours = smoother.estimate(), theirs = ekf.estimate();
  EXPECT_LT(error_of(ours.pose, theirs.pose).norm(), 1e-9);
  EXPECT_LT((ours.covariance - theirs.covariance).norm(), 0.01 * theirs.covariance.norm());
  EXPECT_LT((ours.with_systematic - theirs.with_systematic).norm(), 0.01 * theirs.with_systematic.norm());
  EXPECT_LT((ours.systematic_covariance - theirs.systematic_covariance).norm(), 1e-9);
}

// Of a step's sightings of a landmark that is new only the first can make it.
TEST(IncrementalSmoother, ALandmarkSeenTwiceInItsFirstStepIsCreatedOnce) {
  const SlamWorld world = slam_world({.steps = 1});
  IncrementalSmoother smoother(world.sensor, {});
  const Motion still = motion_of({}, 1e-6 * Matrix3::Identity());
  const std::vector<Observation> seen = {{7, 3.0, 0.2}, {7, 3.1, 0.21}, {8, 4.0, -1.0}, {7, 2.95, 0.19}};
  const auto decisions = [](const StepReport& report) {
    std::vector<Decision> all;
    for (const ObservationReport& observation : report.observations) all.push_back(observation.decision);
    return all;
  };
  const StepReport first = smoother.step(still, seen);
  EXPECT_EQ(decisions(first),
            (std::vector{Decision::created, Decision::matched, Decision::created, Decision::matched}));
  for (std::size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(first.observations[i].landmark, seen[i].landmark);
  ASSERT_EQ(smoother.landmarks(), 2U);
  EXPECT_EQ(smoother.landmark(0).sightings, 3U);
  EXPECT_EQ(decisions(smoother.step(still, seen)), std::vector(4, Decision::matched));
}

// Of many runs: NEES of the last pose, which is χ²₃ if the covariance is right.
TEST(IncrementalSmoother, IsConsistent) {
  const int runs = test::trials(200, 8);
  double sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    const SlamWorld world = slam_world({.steps = 80, .seed = 100 + static_cast<std::uint64_t>(run)});
    IncrementalSmoother smoother(world.sensor, {});
    for (const SlamStep& step : world.steps) smoother.step(step.motion, step.observations);
    const PoseEstimate estimate = smoother.estimate();
    sum += std::pow(in_sigmas(error_of(estimate.pose, world.truth.back()), estimate.covariance), 2);
  }
  EXPECT_GT(sum, chi_squared_limit(1.0 - 5e-4, 3.0 * runs));
  EXPECT_LT(sum, chi_squared_limit(5e-4, 3.0 * runs));
}

// Blind for most of the loop, with turns that are hardly known: what is seen then is mapped a second time,
// until enough is seen to tell. Taken back, nothing is left of it, and the rest is as if it had had names.
TEST(IncrementalSmoother, LandmarksMappedTwiceBecomeOne) {
  SlamWorld world = slam_world({.steps = 120, .sigma_turn_rad = 0.15, .seed = 2});
  IncrementalSmoother smoother(world.sensor, {}), named(world.sensor, {});
  std::set<LandmarkId> shown;
  LandmarkId last = kUnknownLandmark;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation>& sightings = world.steps[k].observations;
    if (k > 20 && k < 62) sightings.clear();
    named.step(world.steps[k].motion, sightings);
    for (Observation& sighting : sightings) {
      shown.insert(sighting.landmark);
      sighting.landmark = kUnknownLandmark;
    }
    for (const ObservationReport& report : smoother.step(world.steps[k].motion, sightings).observations)
      last = std::max(last, report.landmark);
  }
  std::size_t merged = 0;
  for (LandmarkId id = 0; id <= last; ++id) merged += smoother.merged(id) != id ? 1 : 0;
  EXPECT_GT(merged, 0U);
  EXPECT_EQ(smoother.landmarks(), shown.size());
  EXPECT_LT(in_sigmas(error_of(smoother.estimate().pose, named.estimate().pose), named.estimate().covariance),
            0.5);
  IncrementalSmoother again(world.sensor, {});
  resume_state(again, state_of(smoother));
  EXPECT_TRUE(state_of(again) == state_of(smoother));
}

IncrementalSmoother windowed_run(const SlamWorld& world, const IncrementalSmootherOptions& options) {
  IncrementalSmoother smoother(world.sensor, options);
  for (const SlamStep& step : world.steps) smoother.step(step.motion, step.observations, step.time_s);
  return smoother;
}

constexpr double kWindow_s = 1.2;  // of 63 steps of 0.1 s that make a loop

TEST(IncrementalSmoother, AWindowLongerThanTheDriveChangesNothing) {
  const SlamWorld world = slam_world({.steps = 100, .seed = 11});
  EXPECT_TRUE(state_of(windowed_run(world, {.window_s = 10.1})) == state_of(windowed_run(world, {})));
}

// With noise so small that everything is linear, and so few landmarks that all of them stay tied to the pose:
// the window is that of the batch over everything.
void expect_nothing_lost(bool has_bias) {
  SlamWorld world = slam_world({.steps = 130,
                                .sigma_along_m = 2e-5,
                                .sigma_across_m = 4e-6,
                                .sigma_turn_rad = 1e-5,
                                .seed = 12,
                                .systematic = {1e-5, 2e-5, 1e-5}});
  world.sensor.range_sigma_m = 1e-4;
  world.sensor.bearing_sigma_rad = 2e-5;
  Random random(13, 1);
  for (std::size_t k = 0; k < world.steps.size(); ++k)
    world.steps[k].observations = test::look_around(world, world.truth[k], random);
  IncrementalSmootherOptions options{
      .prior = {.systematic_sigma = Systematic::Constant(3, 3e-5)}, .has_bias = has_bias, .gate = 1e9};
  const IncrementalSmoother all = windowed_run(world, options);
  options.window_s = kWindow_s;
  const IncrementalSmoother windowed = windowed_run(world, options);
  EXPECT_LT(windowed.problem().poses, 25);
  Minimiser batch(all.problem());
  const SmoothingState minimum = batch.minimise(all.problem(), all.state(), {.enough = 1e-9}).state;
  const PoseEstimate expected = all.estimate(), estimate = windowed.estimate();
  EXPECT_LT(in_sigmas(error_of(estimate.pose, minimum.poses.back()), expected.covariance), 0.01);
  EXPECT_LT((estimate.covariance - expected.covariance).norm(), 0.001 * expected.covariance.norm());
  EXPECT_LT(in_sigmas(estimate.systematic - expected.systematic, expected.systematic_covariance), 0.01);
  ASSERT_EQ(all.landmarks(), windowed.landmarks());
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < all.landmarks(); ++i) {
    numbers.push_back(i);
    EXPECT_EQ(windowed.landmark(i).sightings, all.landmark(i).sightings);
  }
  const MatrixXd map = all.map_covariance(numbers), windowed_map = windowed.map_covariance(numbers);
  EXPECT_LT((windowed_map - map).norm(), 0.001 * map.norm());
  for (const Observation& seen : world.steps.back().observations)  // far ones are as when they last mattered
    for (const std::size_t i : numbers) {
      const MappedLandmark landmark = windowed.landmark(i);
      if (landmark.id != seen.landmark) continue;
      EXPECT_LT((landmark.position - minimum.landmarks[i]).norm(),
                0.01 * std::sqrt(landmark.covariance.trace()));
    }
}

TEST(IncrementalSmoother, AWindowLosesNothingOfALinearProblem) {
  expect_nothing_lost(false);
}

TEST(IncrementalSmoother, AWindowLosesNothingOfALinearProblemWithABias) {
  expect_nothing_lost(true);
}

/// 95 steps make a loop around 100 landmarks, of which a sixth is in view: a map of several submaps.
SlamWorld submaps_world(int steps, std::uint64_t seed) {
  return slam_world({.steps = steps, .landmarks = 100, .radius_m = 15.0, .step_m = 1.0, .seed = seed});
}

// A loop closes to landmarks that no pose in the window has seen.
TEST(IncrementalSmoother, WithAWindowIsConsistent) {
  const int runs = test::trials(100, 6);
  double sum = 0.0;
  for (int run = 0; run < runs; ++run) {
    const SlamWorld world = submaps_world(105, 300 + static_cast<std::uint64_t>(run));
    const IncrementalSmoother smoother = windowed_run(world, {.window_s = kWindow_s});
    const PoseEstimate estimate = smoother.estimate();
    sum += std::pow(in_sigmas(error_of(estimate.pose, world.truth.back()), estimate.covariance), 2);
  }
  EXPECT_GT(sum, chi_squared_limit(1.0 - 5e-4, 3.0 * runs));
  EXPECT_LT(sum, chi_squared_limit(5e-4, 3.0 * runs));
}

// Lap after lap through the same country: once all submaps are there, its state stays as large as it is.
TEST(IncrementalSmoother, WithAWindowDoesNotGrow) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const SlamWorld world = submaps_world(1330, 14);
  IncrementalSmoother smoother(world.sensor, {.window_s = kWindow_s});
  double early = 0.0, late = 0.0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    smoother.step(world.steps[k].motion, world.steps[k].observations, world.steps[k].time_s);
    if (k >= 630 && k % 5 == 0) (k < 980 ? early : late) += static_cast<double>(state_of(smoother).size());
  }
  EXPECT_LT(late, 1.1 * early);
}

TEST(IncrementalSmoother, WithAWindowGoesOnFromItsState) {
  const SlamWorld world = submaps_world(120, 15);
  const IncrementalSmootherOptions options{.window_s = kWindow_s};
  SlamWorld first = world;
  first.steps.resize(70);
  IncrementalSmoother smoother(world.sensor, options);
  resume_state(smoother, state_of(windowed_run(first, options)));
  for (std::size_t k = 70; k < world.steps.size(); ++k)
    smoother.step(world.steps[k].motion, world.steps[k].observations, world.steps[k].time_s);
  EXPECT_TRUE(state_of(smoother) == state_of(windowed_run(world, options)));
}

// What is mapped twice becomes one also where the first of the two is known by what was marginalised alone;
// as long as what was driven in between is in the window, it is as if it had had names.
TEST(IncrementalSmoother, WithAWindowLandmarksMappedTwiceBecomeOne) {
  SlamWorld world = slam_world({.steps = 120, .sigma_turn_rad = 0.15, .seed = 2});
  SlamWorld named = world;
  const IncrementalSmootherOptions options{.window_s = 3.0};
  std::set<LandmarkId> shown;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation>& sightings = world.steps[k].observations;
    if (k > 20 && k < 62) sightings.clear();
    named.steps[k] = world.steps[k];
    for (Observation& sighting : sightings) {
      shown.insert(sighting.landmark);
      sighting.landmark = kUnknownLandmark;
    }
  }
  const PoseEstimate expected = windowed_run(named, options).estimate();
  const IncrementalSmoother smoother = windowed_run(world, options);
  EXPECT_EQ(smoother.landmarks(), shown.size());
  EXPECT_LT(in_sigmas(error_of(smoother.estimate().pose, expected.pose), expected.covariance), 0.5);
}

// Without names, and with readings that show nothing: what becomes a landmark of theirs is taken out of what
// is marginalised too.
TEST(IncrementalSmoother, WithAWindowForgetsWhatIsNoLandmark) {
  SlamWorld world = submaps_world(200, 16);
  Random random(17, 17);
  for (SlamStep& step : world.steps) {
    for (Observation& sighting : step.observations) sighting.landmark = kUnknownLandmark;
    if (random.below(3) == 0)
      step.observations.push_back({kUnknownLandmark, random.uniform(1.0, 8.0), random.uniform(-kPi, kPi)});
  }
  const IncrementalSmoother smoother = windowed_run(world, {.window_s = kWindow_s});
  std::size_t confirmed = 0;
  for (std::size_t i = 0; i < smoother.landmarks(); ++i) confirmed += smoother.is_confirmed(i) ? 1 : 0;
  EXPECT_LE(confirmed, world.landmarks.size());
  const PoseEstimate estimate = smoother.estimate();
  EXPECT_LT(in_sigmas(error_of(estimate.pose, world.truth.back()), estimate.covariance), 4.0);
}

// One reading in twenty shows nothing: it hardly moves the estimate.
TEST(IncrementalSmoother, WithstandsOutliers) {
  SlamWorld world = slam_world({.steps = 120, .seed = 8});
  Random random(9, 9);
  std::size_t wrong = 0, rejected = 0;
  IncrementalSmoother smoother(world.sensor, {});
  for (SlamStep& step : world.steps) {
    std::vector<bool> is_wrong;
    for (Observation& observation : step.observations) {
      is_wrong.push_back(random.below(20) == 0);
      if (is_wrong.back()) observation.range_m = random.uniform(0.5, 8.0);
    }
    const StepReport& report = smoother.step(step.motion, step.observations);
    for (std::size_t i = 0; i < is_wrong.size(); ++i) {
      if (!is_wrong[i] || report.observations[i].decision == Decision::created) continue;
      ++wrong;
      rejected += report.observations[i].decision == Decision::rejected ? 1 : 0;
    }
  }
  EXPECT_GT(static_cast<double>(rejected),
            0.7 * static_cast<double>(wrong));  // some are near what they replace
  const PoseEstimate estimate = smoother.estimate();
  EXPECT_LT(in_sigmas(error_of(estimate.pose, world.truth.back()), estimate.covariance), 4.5);
}

}  // namespace
}  // namespace trundle::slam
