#include <cmath>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/evaluation/align.hpp"
#include "trundle/evaluation/evaluate.hpp"
#include "trundle/geometry/gaussian.hpp"
#include "trundle/simulation/random.hpp"

namespace trundle {
namespace {

Matrix3 example_covariance() {
  Matrix3 S;
  S << 0.04, 0.01, 0.002, 0.01, 0.09, -0.004, 0.002, -0.004, 0.01;
  return S;
}

/// Truth on a line, estimates with independent errors drawn from `drawn` that claim `claimed`.
struct Independent {
  Trajectory reference;
  Trajectory estimate;

  Independent(const Matrix3& drawn, const Matrix3& claimed, int poses) {
    Random random(3);
    const Matrix3 L = drawn.llt().matrixL();
    for (int k = 0; k < poses; ++k) {
      const Vector3 e = L * Vector3(random.normal(), random.normal(), random.normal());
      const Pose2 truth{0.1 * k, 0.0, 3.1};
      reference.poses.push_back({0.1 * k, truth});
      estimate.poses.push_back(
          {0.1 * k, {truth.x + e.x(), truth.y + e.y(), wrap_angle(truth.heading + e.z())}});
      estimate.covariances.push_back(claimed);
    }
  }
};

TEST(Nees, HonestCovariancesGiveTheirDegreesOfFreedom) {
  constexpr int n = 20000;
  const Independent run(example_covariance(), example_covariance(), n);
  const auto nees = evaluate(run.estimate, run.reference, {.alignment = Alignment::none}).nees;
  ASSERT_TRUE(nees);
  EXPECT_EQ(nees->degrees_of_freedom, 3);
  EXPECT_EQ(nees->poses, std::size_t{n});
  EXPECT_NEAR(nees->mean, 3.0, 4.0 * std::sqrt(6.0 / n));  // Var χ²₃ = 6
  EXPECT_NEAR(nees->share_inside_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / n));
}

TEST(Nees, TooSmallCovariancesShow) {
  const Independent run(example_covariance(), 0.25 * example_covariance(), 5000);
  const auto nees = evaluate(run.estimate, run.reference, {.alignment = Alignment::none}).nees;
  EXPECT_NEAR(nees->mean, 12.0, 4.0 * 4.0 * std::sqrt(6.0 / 5000));
  EXPECT_LT(nees->share_inside_95, 0.5);
}

TEST(Nees, PositionsAloneHaveTwoDegreesOfFreedom) {
  Independent run(example_covariance(), example_covariance(), 20000);
  for (StampedPose& p : run.reference.poses) p.pose.heading = std::nan("");
  const auto nees = evaluate(run.estimate, run.reference, {.alignment = Alignment::none}).nees;
  EXPECT_EQ(nees->degrees_of_freedom, 2);
  EXPECT_NEAR(nees->mean, 2.0, 4.0 * std::sqrt(4.0 / 20000));
  EXPECT_NEAR(nees->share_inside_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / 20000));
}

TEST(Nees, DoesNotDependOnTheFrame) {
  const Independent run(example_covariance(), example_covariance(), 50);
  const Pose2 frame{3.0, -1.0, 2.2};
  Trajectory moved = run.estimate;
  Trajectory truth = run.reference;
  Matrix3 R = Matrix3::Identity();
  R.topLeftCorner<2, 2>() = rotation(frame.heading);
  for (StampedPose& p : moved.poses) p.pose = frame * p.pose;
  for (StampedPose& p : truth.poses) p.pose = frame * p.pose;
  for (Matrix3& S : moved.covariances) S = R * S * R.transpose();
  const auto here = evaluate(run.estimate, run.reference, {.alignment = Alignment::none}).nees;
  const auto there = evaluate(moved, truth, {.alignment = Alignment::none}).nees;
  EXPECT_NEAR(here->mean, there->mean, 1e-9 * here->mean);
}

TEST(Nees, NothingWithoutCovariances) {
  Independent run(example_covariance(), example_covariance(), 10);
  run.estimate.covariances.clear();
  EXPECT_FALSE(evaluate(run.estimate, run.reference).nees);
}

/// Odometry whose increments have independent errors, from a start that is known exactly.
struct DeadReckoning {
  Twist2 step{0.1, 0.0, 0.03};
  Matrix3 step_covariance = Vector3(1e-4, 1e-6, 1e-5).asDiagonal();

  std::vector<GaussianPose> chain(int length) const {
    std::vector<GaussianPose> poses = {{{1.0, 2.0, 0.5}, Matrix3::Zero()}};
    for (int k = 1; k < length; ++k) poses.push_back(poses.back() * GaussianPose{exp(step), step_covariance});
    return poses;
  }
};

TEST(StartAlignment, CovariancesAreThoseOfTheMotionSinceTheFirstCommonPose) {
  const DeadReckoning odometry;
  const auto chain = odometry.chain(60);
  constexpr std::size_t first = 25;
  std::vector<PosePair> pairs;
  for (std::size_t k = first; k < chain.size(); ++k)
    pairs.push_back({0.1 * double(k), chain[k].mean, chain[k].mean, world_covariance(chain[k])});
  start_covariances_from_zero(pairs);
  GaussianPose since{{}, Matrix3::Zero()};
  for (const PosePair& pair : pairs) {
    const Matrix3 expected = world_covariance({pair.estimate, since.covariance});
    EXPECT_LT((*pair.covariance - expected).norm(), 1e-12);
    since = since * GaussianPose{exp(odometry.step), odometry.step_covariance};
  }
}

TEST(StartAlignment, HonestOdometryIsHonestOverManyRuns) {
  const DeadReckoning odometry;
  const auto chain = odometry.chain(40);
  const Vector3 sigma = odometry.step_covariance.diagonal().cwiseSqrt();
  double last = 0.0;
  constexpr int kRuns = 2000;
  for (int run = 0; run < kRuns; ++run) {
    Random random(17, static_cast<std::uint64_t>(run));
    Trajectory estimate, reference;
    Pose2 truth = chain.front().mean;
    for (std::size_t k = 0; k < chain.size(); ++k) {
      estimate.poses.push_back({0.1 * double(k), chain[k].mean});
      estimate.covariances.push_back(world_covariance(chain[k]));
      if (k == 10 || k + 1 == chain.size()) reference.poses.push_back({0.1 * double(k), truth});
      const Vector3 e = sigma.cwiseProduct(Vector3(random.normal(), random.normal(), random.normal()));
      truth = truth * exp(odometry.step) * exp(Twist2::from(e));
    }
    const auto nees = evaluate(estimate, reference).nees;
    ASSERT_EQ(nees->poses, 1u);
    ASSERT_EQ(nees->without_covariance, 1u);  // the first pose is exact by definition
    last += nees->mean / kRuns;
  }
  EXPECT_NEAR(last, 3.0, 4.0 * std::sqrt(6.0 / kRuns));
}

}  // namespace
}  // namespace trundle
