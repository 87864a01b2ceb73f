#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

#include "trundle/evaluation/align.hpp"
#include "trundle/evaluation/evaluate.hpp"
#include "trundle/geometry/gaussian.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::evaluation {
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
    ASSERT_EQ(nees->before_motion, 1u);  // the first pose is exact by definition
    last += nees->mean / kRuns;
  }
  EXPECT_NEAR(last, 3.0, 4.0 * std::sqrt(6.0 / kRuns));
}

/// Odometry along a bend with errors of its own, and a reference that trembles by what it states.
struct Trembling {
  Trajectory reference;
  Trajectory estimate;

  Trembling(const ReferenceSigmas& noise, double step_sigma, std::uint64_t seed) {
    Random random(29, seed);
    Pose2 truth{1.0, 2.0, 0.4}, odometry;
    Matrix3 covariance = Matrix3::Zero();
    for (int k = 0; k < 60; ++k) {
      const Pose2 measured{truth.x + random.normal(noise.position_sigma_m),
                           truth.y + random.normal(noise.position_sigma_m),
                           wrap_angle(truth.heading + random.normal(noise.heading_sigma_rad))};
      reference.poses.push_back({0.1 * k, measured});
      estimate.poses.push_back({0.1 * k, odometry});
      estimate.covariances.push_back(world_covariance({odometry, covariance}));
      const Pose2 step = exp(Twist2{0.1, 0.0, 0.05});
      const Vector3 e = step_sigma * Vector3(random.normal(), random.normal(), random.normal());
      truth = truth * step;
      odometry = odometry * (step * exp(Twist2{e.x(), e.y(), e.z()}));
      const Matrix3 Ad = adjoint(step.inverse());
      covariance = Ad * covariance * Ad.transpose() + step_sigma * step_sigma * Matrix3::Identity();
    }
  }
};

/// Mean NEES of the last pose, and how many of its poses lie inside 95 %, over many runs.
std::pair<double, double> mean_over_runs(const ReferenceSigmas& noise, const EvaluateOptions& options,
                                         int runs) {
  double nees = 0.0, inside = 0.0;
  for (int run = 0; run < runs; ++run) {
    const Trembling drive(noise, 1e-3, static_cast<std::uint64_t>(run));
    const auto found = evaluate(drive.estimate, drive.reference, options).nees;
    nees += found->mean / runs;
    inside += found->share_inside_95 / runs;
  }
  return {nees, inside};
}

TEST(ReferenceNoise, AReferenceThatTremblesIsNoErrorOfTheEstimate) {
  const ReferenceSigmas noise{.position_sigma_m = 0.004, .heading_sigma_rad = 0.006};
  constexpr int kRuns = 400;
  const EvaluateOptions told{.alignment = Alignment::start, .reference_noise = noise};
  const auto [nees, inside] = mean_over_runs(noise, told, kRuns);
  // The mean over a run scatters at most as one pose's NEES does: by sqrt(6).
  EXPECT_NEAR(nees, 3.0, 4.0 * std::sqrt(6.0 / kRuns));
  EXPECT_NEAR(inside, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / kRuns));
  const auto [as_exact, inside_as_exact] = mean_over_runs(noise, {.alignment = Alignment::start}, kRuns);
  EXPECT_GT(as_exact, 6.0);
  EXPECT_LT(inside_as_exact, 0.8);
}

TEST(ReferenceNoise, InOneFrameItCountsAtEachStampAlone) {
  constexpr int n = 20000;
  Independent run(example_covariance(), example_covariance(), n);
  Random random(31);
  const ReferenceSigmas noise{.position_sigma_m = 0.3, .heading_sigma_rad = 0.1};
  for (StampedPose& p : run.reference.poses) {
    p.pose.x += random.normal(noise.position_sigma_m);
    p.pose.y += random.normal(noise.position_sigma_m);
    p.pose.heading = wrap_angle(p.pose.heading + random.normal(noise.heading_sigma_rad));
  }
  const Evaluation told =
      evaluate(run.estimate, run.reference, {.alignment = Alignment::none, .reference_noise = noise});
  EXPECT_NEAR(told.nees->mean, 3.0, 4.0 * std::sqrt(6.0 / n));
  EXPECT_NEAR(told.nees->share_inside_95, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / n));
  EXPECT_TRUE(told.reference_noise.stated());
  EXPECT_FALSE(evaluate(run.estimate, run.reference).reference_noise.stated());
}

TEST(Nees, OfOdometryBeginsWhereItMoves) {
  Trajectory reference, estimate;
  for (int k = 0; k < 100; ++k) {
    const double x = 0.02 * std::max(0, k - 50);  // stands for five seconds
    reference.poses.push_back({0.1 * k, {x + (k % 2) * 1e-3, 0.0, 0.0}});
    estimate.poses.push_back({0.1 * k, {x, 0.0, 0.0}});
    const double sigma = 1e-6 + 2e-3 * std::sqrt(x);
    estimate.covariances.push_back(sigma * sigma * Matrix3::Identity());
  }
  const auto nees = evaluate(estimate, reference, {.alignment = Alignment::start}).nees;
  EXPECT_EQ(nees->before_motion, 51);
  EXPECT_EQ(nees->poses, 49);
  EXPECT_LT(nees->mean, 10.0);  // a thousandth of what the standing poses would make of it
  const auto in_one_frame = evaluate(estimate, reference, {.alignment = Alignment::none}).nees;
  EXPECT_EQ(in_one_frame->before_motion, 0);
}

}  // namespace
}  // namespace trundle::evaluation
