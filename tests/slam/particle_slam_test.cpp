#include "trundle/slam/fastslam/particle_slam.hpp"

#include <limits>
#include <numeric>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/ekf/ekf.hpp"
#include "trundle/statistics/distribution.hpp"

#include "scale.hpp"
#include "slam/copying_fastslam.hpp"
#include "slam/every_proposal.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

TEST(ParticleSlam, IsTheCopyingFilterToTheLastBit) {
  test::SlamWorld world = test::slam_world({.steps = 150});
  for (std::size_t k = 0; k < 150; k += 4) world.steps[k].observations.clear();
  ParticleSlam lazy(world.sensor, {.proposal = Proposal::motion,
                                   .particles = 150,
                                   .seed = 9,
                                   .prior = {.systematic_sigma = Systematic::Zero(3)},
                                   .gate = std::numeric_limits<double>::infinity()});
  test::CopyingFastSlam copying(world.sensor, 150, 9);
  for (const SlamStep& step : world.steps) {
    lazy.step(step.motion, step.observations);
    copying.step(step);
    const std::vector<Pose2> poses = lazy.poses();
    for (std::size_t i = 0; i < 150; ++i) {
      const Pose2 copied = copying.particles[i].pose.at(0);
      ASSERT_EQ(poses[i].x, copied.x);
      ASSERT_EQ(poses[i].y, copied.y);
      ASSERT_EQ(poses[i].heading, copied.heading);
    }
  }
  EXPECT_GT(copying.resamplings, 20U);
  std::size_t best = 0;
  for (std::size_t i = 0; i < 150; ++i)
    if (copying.particles[i].log_weight > copying.particles[best].log_weight) best = i;
  const std::vector<Pose2> path = lazy.best_path();
  ASSERT_EQ(path.size(), world.steps.size());
  std::size_t keyframe = 0;
  for (std::size_t k = 0; k < path.size(); ++k)
    if (!world.steps[k].observations.empty()) {
      ASSERT_EQ(path[k].x, copying.particles[best].path[keyframe++].x);
    }
  const std::vector<double> weights = lazy.weights();
  for (std::size_t l = 0; l < lazy.landmarks(); ++l) {
    const MappedLandmark landmark = lazy.landmark(l);
    Vector2 mean = Vector2::Zero();
    for (std::size_t i = 0; i < 150; ++i) {
      const LandmarkEstimate m = copying.particles[i].map.at(landmark.id).at(0);
      mean += weights[i] * Vector2(m.x, m.y);
    }
    ASSERT_EQ(landmark.position, mean);
  }
}

double end_error(const test::SlamWorld& world, const ParticleSlamOptions& options) {
  ParticleSlam filter(world.sensor, options);
  double squares = 0.0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    filter.step(world.steps[k].motion, world.steps[k].observations);
    squares += (filter.estimate().pose.translation() - world.truth[k].translation()).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(world.steps.size()));
}

double dead_reckoning_error(const test::SlamWorld& world) {
  Pose2 pose;
  double squares = 0.0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    pose = pose * world.steps[k].motion.mean;
    squares += (pose.translation() - world.truth[k].translation()).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(world.steps.size()));
}

class EveryProposal : public testing::TestWithParam<Proposal> {};

TEST_P(EveryProposal, FindsTheWayAndTheMap) {
  double reckoned = 0.0;
  double filtered = 0.0;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const test::SlamWorld world = test::slam_world({.seed = seed});
    reckoned += dead_reckoning_error(world) / 5.0;
    filtered += end_error(world, {.proposal = GetParam(), .particles = 50, .seed = seed}) / 5.0;
  }
  EXPECT_LT(filtered, 0.5 * reckoned);
  EXPECT_LT(filtered, 0.3);
}

TEST_P(EveryProposal, SameSeedSameBytesAndACopyContinues) {
  const test::SlamWorld world = test::slam_world({.steps = 60});
  ParticleSlam first(world.sensor, {.proposal = GetParam(), .particles = 70});
  ParticleSlam second = first;
  for (const SlamStep& step : world.steps) {
    first.step(step.motion, step.observations);
    second.step(step.motion, step.observations);
    second = ParticleSlam(second);
  }
  EXPECT_EQ(first.estimate().pose.x, second.estimate().pose.x);
  EXPECT_EQ(first.estimate().covariance, second.estimate().covariance);
  EXPECT_EQ(first.landmark(3).position, second.landmark(3).position);
}

TEST_P(EveryProposal, AnyNumberOfThreadsGivesTheSameBytes) {
  const test::SlamWorld world = test::slam_world({.steps = 60});
  ParticleSlam one(world.sensor, {.proposal = GetParam(), .particles = 300});
  ParticleSlam three(world.sensor, {.proposal = GetParam(), .particles = 300, .threads = 3});
  for (const SlamStep& step : world.steps) {
    one.step(step.motion, step.observations);
    three.step(step.motion, step.observations);
  }
  const std::vector<Pose2> poses = one.poses();
  const std::vector<Pose2> others = three.poses();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].x, others[i].x);
    EXPECT_EQ(poses[i].heading, others[i].heading);
  }
  EXPECT_EQ(one.landmark(3).covariance, three.landmark(3).covariance);
}

TEST_P(EveryProposal, SurvivesWhateverItIsShown) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Observation> nonsense = {
      {0, kNan, 0.0}, {0, -1.0, 0.0},  {1, 2.0, kNan},   {kUnknownLandmark, 2.0, 1.0},
      {2, 0.0, 0.0},  {0, 1e308, 0.0}, {1, 1e-300, 0.0}, {3, 3.0, 1.0},
      {3, 3.0, 1.0},  {3, 3.0, 1.0}};
  const test::SlamWorld world = test::slam_world({.steps = 40});
  for (const std::size_t particles : {1U, 2U, 3U, 7U}) {
    ParticleSlam filter(world.sensor, {.proposal = GetParam(), .particles = particles});
    filter.step({}, nonsense);  // and without any motion
    for (const SlamStep& step : world.steps) {
      filter.step(step.motion, step.observations);
      const StepReport& report = filter.step(step.motion, nonsense);
      EXPECT_EQ(report.observations[0].decision, Decision::invalid);
      EXPECT_EQ(report.observations[1].decision, Decision::invalid);
      ASSERT_TRUE(std::isfinite(filter.estimate().pose.x + filter.estimate().pose.y +
                                filter.estimate().pose.heading));
      ASSERT_TRUE(filter.estimate().covariance.allFinite());
    }
    for (std::size_t i = 0; i < filter.landmarks(); ++i)
      ASSERT_TRUE(filter.landmark(i).position.allFinite() && filter.landmark(i).covariance.allFinite());
  }
}

INSTANTIATE_TEST_SUITE_P(, EveryProposal, test::every_proposal(), test::name_of_proposal);

/// Once around a room.
test::SlamWorld room(int seed, int steps = 315) {
  return test::slam_world({.steps = steps,
                           .step_m = 0.1,
                           .sigma_along_m = 0.005,
                           .sigma_across_m = 0.001,
                           .sigma_turn_rad = 0.004,
                           .seed = static_cast<std::uint64_t>(seed)});
}

double ekf_error(const test::SlamWorld& world) {
  EkfSlam filter(world.sensor, {});
  double squares = 0.0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    filter.step(world.steps[k].motion, world.steps[k].observations);
    squares += (filter.estimate().pose.translation() - world.truth[k].translation()).squaredNorm();
  }
  return std::sqrt(squares / static_cast<double>(world.steps.size()));
}

class InARoom : public testing::TestWithParam<Proposal> {};

/// What resampling has taken from the particles is no longer in their covariance (docs/theory/fastslam.md,
/// what resampling loses): before the first resampling it is consistent, later their error is all that can be
/// asked for.
TEST_P(InARoom, CovarianceIsConsistentBeforeAnyResampling) {
  const int runs = test::trials(40, 10);
  double nees = 0.0;
  for (int seed = 1; seed <= runs; ++seed) {
    const test::SlamWorld world = room(seed, 20);
    ParticleSlam filter(world.sensor, {.proposal = GetParam(),
                                       .particles = 2000,
                                       .seed = static_cast<std::uint64_t>(seed),
                                       .resample_below = 0.0});
    for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
    const PoseEstimate estimate = filter.estimate();
    const Vector3 e = log(estimate.pose.inverse() * world.truth.back()).vector();
    nees += e.dot(body_covariance(estimate.pose, estimate.covariance).ldlt().solve(e));
  }
  RecordProperty("nees", std::to_string(nees / runs));
  EXPECT_GT(nees, chi_squared_limit(0.9995, 3.0 * runs));
  EXPECT_LT(nees, chi_squared_limit(0.0005, 3.0 * runs));
}

TEST_P(InARoom, IsAtMostHalfAsFarOffAgainAsTheEkf) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  constexpr int runs = 20;  // of five, one room decides the ratio
  double squares = 0.0;
  double of_ekf = 0.0;
  for (int seed = 1; seed <= runs; ++seed) {
    const test::SlamWorld world = room(seed);
    const double error = end_error(world, {.proposal = GetParam(), .seed = static_cast<std::uint64_t>(seed)});
    squares += error * error / runs;
    of_ekf += ekf_error(world) * ekf_error(world) / runs;
  }
  RecordProperty("ratio", std::to_string(std::sqrt(squares / of_ekf)));
  EXPECT_LT(std::sqrt(squares), 1.5 * std::sqrt(of_ekf));
}

/// One sighting in twenty bears another landmark's name.
TEST_P(InARoom, WrongNamesMakeItAtMostTwiceAsFarOff) {
  const int runs = test::trials(10, 4);
  double squares = 0.0;
  double without = 0.0;
  for (int seed = 1; seed <= runs; ++seed) {
    test::SlamWorld world = room(seed);
    const ParticleSlamOptions options{.proposal = GetParam(), .seed = static_cast<std::uint64_t>(seed)};
    without += std::pow(end_error(world, options), 2.0) / runs;
    Random random(static_cast<std::uint64_t>(seed), 9);
    for (SlamStep& step : world.steps)
      for (Observation& seen : step.observations)
        if (random.uniform() < 0.05) seen.landmark = static_cast<LandmarkId>(random.below(20));
    squares += std::pow(end_error(world, options), 2.0) / runs;
  }
  RecordProperty("ratio", std::to_string(std::sqrt(squares / without)));
  EXPECT_LT(std::sqrt(squares), 2.0 * std::sqrt(without));
}

INSTANTIATE_TEST_SUITE_P(, InARoom, testing::Values(Proposal::linearised, Proposal::swarm_gaussian),
                         test::name_of_proposal);

TEST(ParticleSlam, LearnsTheOdometrysSystematicErrors) {
  // On one circle turning and turning per metre look alike: the sum of both is what can be told.
  const Vector3 truth(0.04, 0.06, 0.0);
  const Vector3 sigma(0.05, 0.05, 0.0);
  Vector3 mean = Vector3::Zero();
  const int seeds = test::trials(8, 4);
  for (int seed = 1; seed <= seeds; ++seed) {
    const test::SlamWorld world =
        test::slam_world({.steps = 300, .seed = static_cast<std::uint64_t>(seed), .systematic = truth});
    ParticleSlam filter(world.sensor, {.particles = 60, .prior = {.systematic_sigma = sigma}});
    for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
    mean += filter.estimate().systematic / seeds;
  }
  // The travel's scale is only told by ranges: a long loop's error stays in it.
  EXPECT_NEAR(mean[0], truth[0], 0.02);
  EXPECT_NEAR(mean[1], truth[1], 0.02);
}

TEST(ParticleSlam, NeedsAParticle) {
  EXPECT_THROW(ParticleSlam(LandmarkSensor{}, {.particles = 0}), InputError);
}

TEST(ParticleSlam, OutliersAreRejectedAndCounted) {
  const test::SlamWorld world = test::slam_world({.steps = 100});
  ParticleSlam filter(world.sensor, {.proposal = Proposal::linearised, .particles = 50});
  int rejected = 0;
  int honest_rejected = 0;
  double worst = 0.0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation> observations = world.steps[k].observations;
    const std::size_t honest = observations.size();
    const LandmarkId wrong = filter.landmarks() > 0 ? filter.landmark(0).id : kUnknownLandmark;
    observations.push_back({wrong, 30.0, 1.0});
    const StepReport& report = filter.step(world.steps[k].motion, observations);
    for (std::size_t i = 0; i < observations.size(); ++i)
      if (report.observations[i].decision == Decision::rejected) ++(i < honest ? honest_rejected : rejected);
    worst = std::max(worst, (filter.estimate().pose.translation() - world.truth[k].translation()).norm());
  }
  EXPECT_GE(rejected, 99);
  EXPECT_LE(honest_rejected, 10);
  EXPECT_LT(worst, 1.0);
}

TEST(ParticleSlam, FewerAndFewerAncestorsAreLeftTheFurtherBack) {
  const test::SlamWorld world = test::slam_world({.steps = 300});
  ParticleSlam filter(world.sensor, {.proposal = Proposal::motion, .particles = 40});
  bool resampled = false;
  for (const SlamStep& step : world.steps) {
    resampled = filter.step(step.motion, step.observations).resampled || resampled;
    if (!resampled) {
      EXPECT_EQ(filter.ancestors(0), 40U);
    }
  }
  for (std::size_t back = 1; back < 300; ++back)
    EXPECT_LE(filter.ancestors(back), filter.ancestors(back - 1)) << back;
  EXPECT_GT(filter.ancestors(0), 1U);
  EXPECT_EQ(filter.ancestors(299), 1U);
}

TEST(ParticleSlam, WithoutPathsMemoryDoesNotGrow) {
  const test::SlamWorld world = test::slam_world({.steps = 50});
  ParticleSlam filter(world.sensor, {.particles = 10, .keep_paths = false});
  for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
  EXPECT_EQ(filter.stored_poses(), 0U);
  EXPECT_TRUE(filter.best_path().empty());
}

TEST(ParticleSlam, StoredPathsAreLittleMoreThanOne) {
  const test::SlamWorld world = test::slam_world({.steps = 600});
  ParticleSlam filter(world.sensor, {.particles = 100});
  for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
  EXPECT_EQ(filter.best_path().size(), 600U);
  EXPECT_LT(filter.stored_poses(), 600U * 100U / 4U);
}

}  // namespace
}  // namespace trundle::slam
