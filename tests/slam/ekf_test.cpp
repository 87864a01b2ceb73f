#include "trundle/slam/ekf/ekf.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "scale.hpp"
#include "slam/dense_ekf.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

constexpr double kNoGate = std::numeric_limits<double>::infinity();

Matrix3 some_covariance() {
  return Vector3(0.01, 0.02, 0.003).asDiagonal();
}

Eigen::MatrixXd without_systematic(const Eigen::MatrixXd& P) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index i = 0; i < P.rows(); ++i)
    if (i < 3 || i >= 6) kept.push_back(i);
  return P(kept, kept);
}

TEST(Ekf, IsTheDenseTextbookFilter) {
  const test::SlamWorld world = test::slam_world({.steps = 150});
  const Pose2 start{1.0, -2.0, 0.5};
  EkfSlam filter(world.sensor, {{start, some_covariance(), Systematic::Zero(3)}, kNoGate});
  test::DenseEkf dense{world.sensor, Vector3(start.x, start.y, start.heading), some_covariance()};
  for (const SlamStep& step : world.steps) {
    filter.step(step.motion, step.observations);
    dense.step(step);
    ASSERT_NEAR(filter.estimate().pose.x, dense.x[0], 1e-9);
    ASSERT_NEAR(filter.estimate().pose.y, dense.x[1], 1e-9);
    ASSERT_NEAR(filter.estimate().pose.heading, dense.x[2], 1e-9);
  }
  ASSERT_EQ(filter.covariance().rows(), dense.P.rows() + 3);
  ASSERT_GT(filter.landmarks(), 10U);
  EXPECT_LT((without_systematic(filter.covariance()) - dense.P).norm(), 1e-9 * dense.P.norm());
  for (std::size_t i = 0; i < filter.landmarks(); ++i) {
    const MappedLandmark landmark = filter.landmark(i);
    EXPECT_LT((landmark.position - dense.x.segment<2>(dense.at.at(landmark.id))).norm(), 1e-9);
  }
}

TEST(Ekf, GateKeepsAnOutlierOut) {
  const test::SlamWorld world = test::slam_world({.steps = 60});
  EkfSlam with(world.sensor, {});
  EkfSlam without(world.sensor, {});
  int rejected = 0;
  for (const SlamStep& step : world.steps) {
    std::vector<Observation> spoilt = step.observations;
    const LandmarkId known = with.landmarks() > 0 ? with.landmark(0).id : kUnknownLandmark;
    if (known >= 0) spoilt.push_back({known, 20.0, 3.0});
    without.step(step.motion, step.observations);
    for (const ObservationReport& report : with.step(step.motion, spoilt).observations)
      rejected += report.decision == Decision::rejected && report.nis > kDefaultGate ? 1 : 0;
  }
  EXPECT_GE(rejected, 59);
  EXPECT_NEAR(with.estimate().pose.x, without.estimate().pose.x, 1e-12);
  EXPECT_LT((with.covariance() - without.covariance()).norm(), 1e-12);
}

TEST(Ekf, InnovationsAreAsLargeAsTheyAreSaidToBe) {
  // Each NIS is χ² with two degrees of freedom: mean 2, variance 4. Within one world they are nearly
  // independent; 4 sigma of their mean, and 0.1 for the linearisation.
  double sum = 0.0;
  double count = 0.0;
  for (int seed = 1; seed <= test::trials(10, 3); ++seed) {
    const test::SlamWorld world = test::slam_world({.steps = 100, .seed = static_cast<std::uint64_t>(seed)});
    EkfSlam filter(world.sensor, {{.systematic_sigma = Systematic::Zero(3)}, kNoGate});
    for (const SlamStep& step : world.steps)
      for (const ObservationReport& report : filter.step(step.motion, step.observations).observations)
        if (report.decision == Decision::matched) {
          sum += report.nis;
          count += 1.0;
        }
  }
  ASSERT_GT(count, 1000.0);
  EXPECT_NEAR(sum / count, 2.0, 4.0 * 2.0 / std::sqrt(count) + 0.1);
}

TEST(Ekf, LearnsTheOdometrysSystematicErrors) {
  const Vector3 truth(0.04, 0.06, 0.0);
  const test::SlamWorld world = test::slam_world({.steps = 300, .systematic = truth});
  EkfSlam filter(world.sensor, {{.systematic_sigma = Vector3(0.05, 0.05, 0.0)}});
  for (const SlamStep& step : world.steps) filter.step(step.motion, step.observations);
  const PoseEstimate estimate = filter.estimate();
  for (int i = 0; i < 2; ++i) {
    const double sigma = std::sqrt(estimate.systematic_covariance(i, i));
    EXPECT_NEAR(estimate.systematic[i], truth[i], 4.0 * sigma);
    EXPECT_LT(sigma, 0.01);
  }
}

TEST(Ekf, WithoutNamesFindsTheSameMap) {
  const test::SlamWorld world = test::slam_world({.steps = 200});
  EkfSlam named(world.sensor, {});
  EkfSlam unidentified(world.sensor, {});
  double worst = 0.0;
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    std::vector<Observation> hidden = world.steps[k].observations;
    std::ranges::reverse(hidden);
    for (Observation& observation : hidden) observation.landmark = kUnknownLandmark;
    named.step(world.steps[k].motion, world.steps[k].observations);
    unidentified.step(world.steps[k].motion, hidden);
    const Vector2 apart = unidentified.estimate().pose.translation() - named.estimate().pose.translation();
    worst = std::max(worst, apart.norm());
  }
  EXPECT_EQ(unidentified.landmarks(), named.landmarks());
  EXPECT_LT(worst, 0.1);
}

TEST(Ekf, HonestSightingsWithoutNamesMakeHardlyAnyPhantom) {
  const int worlds = test::trials(16, 4);
  double sightings = 0.0;
  double phantoms = 0.0;
  for (int i = 0; i < worlds; ++i) {
    const test::SlamWorld world =
        test::slam_world({.steps = 400, .landmarks = 10, .seed = 100 + static_cast<std::uint64_t>(i)});
    EkfSlam filter(world.sensor, {});
    for (const SlamStep& step : world.steps) {
      std::vector<Observation> hidden = step.observations;
      for (Observation& observation : hidden) observation.landmark = kUnknownLandmark;
      const StepReport& report = filter.step(step.motion, hidden);
      sightings += static_cast<double>(hidden.size());
      for (const ObservationReport& o : report.observations) {
        phantoms += o.decision == Decision::created ? 1.0 : 0.0;
        EXPECT_TRUE(o.decision != Decision::rejected || o.nis > 0.0);
      }
    }
    phantoms -= static_cast<double>(world.landmarks.size());
  }
  // What is beyond twice the gate of 99 % is one sighting in ten thousand; of so many, chance allows four
  // sigmas more.
  const double expected = 1e-4 * sightings;
  EXPECT_LT(phantoms, expected + 4.0 * std::sqrt(expected));
}

TEST(Ekf, NoLandmarkIsSeenTwiceAtOnce) {
  LandmarkSensor sensor;
  EkfSlam filter(sensor, {});
  const std::vector<Observation> first = {{kUnknownLandmark, 3.0, 0.0}};
  filter.step({}, first);
  const std::vector<Observation> both = {{kUnknownLandmark, 3.5, 0.0}, {kUnknownLandmark, 3.0, 0.0}};
  const StepReport& report = filter.step({}, both);
  EXPECT_EQ(report.observations[1].decision, Decision::matched);
  EXPECT_EQ(report.observations[0].decision, Decision::rejected);  // near the landmark: not a new one
  EXPECT_EQ(filter.landmarks(), 1U);
}

TEST(Ekf, DuplicatesAndTwoSightingsOfANewLandmark) {
  LandmarkSensor sensor;
  EkfSlam filter(sensor, {});
  const std::vector<Observation> twice = {{7, 2.0, 0.1}, {7, 2.0, 0.1}};
  const StepReport& report = filter.step({}, twice);
  EXPECT_EQ(report.observations[0].decision, Decision::created);
  EXPECT_EQ(report.observations[1].decision, Decision::matched);
  ASSERT_EQ(filter.landmarks(), 1U);
  EXPECT_EQ(filter.landmark(0).sightings, 2U);
  EXPECT_NEAR(filter.landmark(0).covariance.determinant(), 0.25 * std::pow(0.1 * 2.0 * 0.03, 2), 1e-9);
}

}  // namespace
}  // namespace trundle::slam
