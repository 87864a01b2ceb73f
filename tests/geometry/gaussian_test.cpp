#include "trundle/geometry/gaussian.hpp"

#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "geometry/twists.hpp"

namespace trundle::geometry {
namespace {

using test::any_pose;
using test::vector_of;

Matrix3 some_covariance(double scale, double correlation) {
  Matrix3 S;
  S << 1.0, correlation, 0.0, correlation, 2.0, -correlation, 0.0, -correlation, 0.5;
  return scale * scale * S;
}

/// Draws poses mean · exp(e), e ~ N(0, covariance).
class PoseSampler {
 public:
  PoseSampler(const GaussianPose& pose, unsigned seed)
      : mean_(pose.mean), factor_(pose.covariance.llt().matrixL()), engine_(seed) {}

  Pose2 operator()() {
    const Vector3 e(normal_(engine_), normal_(engine_), normal_(engine_));
    return mean_ * exp(Twist2::from(factor_ * e));
  }

 private:
  Pose2 mean_;
  Matrix3 factor_;
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

/// Sample covariance of log(mean⁻¹ · draw).
template <class Draw>
Matrix3 scatter(const Pose2& mean, int draws, Draw draw) {
  Matrix3 sum = Matrix3::Zero();
  for (int i = 0; i < draws; ++i) {
    const Vector3 e = log(mean.inverse() * draw()).vector();
    sum += e * e.transpose();
  }
  return sum / draws;
}

/// Entries of a sample covariance of n draws scatter by sqrt((s_ii s_jj + s_ij²)/n); 5 of them, and
/// first-order error.
void expect_like(const Matrix3& sample, const Matrix3& expected, int draws) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double sigma =
          std::sqrt((expected(i, i) * expected(j, j) + expected(i, j) * expected(i, j)) / draws);
      EXPECT_NEAR(sample(i, j), expected(i, j), 5 * sigma) << i << ' ' << j;
    }
}

constexpr int kDraws = 200000;

TEST(GaussianPose, product_agrees_with_monte_carlo) {
  // Sigmas of 1 mm and 1 mrad: second-order terms are 1e-6 of the covariance, below its scatter of 2e-3.
  const GaussianPose a{{1.0, -2.0, 2.5}, some_covariance(1e-3, 0.4)};
  const GaussianPose b{exp({0.8, 0.1, -1.2}), some_covariance(1e-3, -0.3)};
  const GaussianPose ab = a * b;
  PoseSampler draw_a(a, 1);
  PoseSampler draw_b(b, 2);
  expect_like(scatter(ab.mean, kDraws, [&] { return draw_a() * draw_b(); }), ab.covariance, kDraws);
}

TEST(GaussianPose, inverse_agrees_with_monte_carlo) {
  const GaussianPose a{{1.0, -2.0, 2.5}, some_covariance(1e-3, 0.4)};
  const GaussianPose back = inverse(a);
  PoseSampler draw(a, 3);
  expect_like(scatter(back.mean, kDraws, [&] { return draw().inverse(); }), back.covariance, kDraws);
}

TEST(GaussianPose, world_covariance_agrees_with_monte_carlo) {
  const GaussianPose a{{1.0, -2.0, 2.5}, some_covariance(1e-3, 0.4)};
  PoseSampler draw(a, 4);
  Matrix3 sum = Matrix3::Zero();
  for (int i = 0; i < kDraws; ++i) {
    const Vector3 e = vector_of(draw()) - vector_of(a.mean);
    sum += e * e.transpose();
  }
  expect_like(sum / kDraws, world_covariance(a), kDraws);
}

RC_GTEST_PROP(GaussianPose, product_is_associative, ()) {
  const GaussianPose a{*any_pose(), some_covariance(0.01, 0.4)};
  const GaussianPose b{*any_pose(), some_covariance(0.02, -0.5)};
  const GaussianPose c{*any_pose(), some_covariance(0.03, 0.1)};
  const Matrix3 left = ((a * b) * c).covariance;
  const Matrix3 right = (a * (b * c)).covariance;
  RC_ASSERT((left - right).norm() < 1e-12 * left.norm());
}

RC_GTEST_PROP(GaussianPose, a_certain_pose_carries_the_covariance_by_the_adjoint, ()) {
  const GaussianPose a{*any_pose(), some_covariance(0.01, 0.4)};
  const GaussianPose b{*any_pose()};
  const Matrix3 Ad = adjoint(b.mean.inverse());
  RC_ASSERT(((a * b).covariance - Ad * a.covariance * Ad.transpose()).norm() < 1e-14);
  RC_ASSERT((b * a).covariance == a.covariance);
}

RC_GTEST_PROP(GaussianPose, inverse_twice_is_the_same, ()) {
  const GaussianPose a{*any_pose(), some_covariance(0.01, 0.4)};
  RC_ASSERT((inverse(inverse(a)).covariance - a.covariance).norm() < 1e-12);
}

RC_GTEST_PROP(GaussianPose, body_and_world_covariance_undo_each_other, ()) {
  const GaussianPose a{*any_pose(), some_covariance(0.01, 0.4)};
  RC_ASSERT((body_covariance(a.mean, world_covariance(a)) - a.covariance).norm() < 1e-17);
}

TEST(GaussianPose, an_uncertain_heading_makes_a_long_way_uncertain_sideways) {
  GaussianPose start;
  start.covariance(2, 2) = 0.01 * 0.01;
  const GaussianPose end = start * GaussianPose{{10.0, 0.0, 0.0}};
  EXPECT_NEAR(end.covariance(1, 1), 0.1 * 0.1, 1e-15);
  EXPECT_NEAR(end.covariance(1, 2), 0.1 * 0.01, 1e-15);
  EXPECT_EQ(end.covariance(0, 0), 0.0);
}

TEST(PositionSigma, is_the_root_of_the_mean_square_distance) {
  Matrix3 covariance = some_covariance(1.0, 0.4);
  covariance.topLeftCorner<2, 2>() << 9.0, 5.0, 5.0, 16.0;
  EXPECT_DOUBLE_EQ(position_sigma(covariance), 5.0);
  EXPECT_DOUBLE_EQ(position_sigma(Matrix2(covariance.topLeftCorner<2, 2>())), 5.0);
}

}  // namespace
}  // namespace trundle::geometry
