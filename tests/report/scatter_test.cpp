#include "trundle/report/scatter.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace trundle::report {
namespace {

std::vector<Vector2> gaussian_points(int count, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  std::vector<Vector2> points;
  const Matrix2 stretched = rotation(0.4) * Vector2(0.03, 0.01).asDiagonal();
  for (int i = 0; i < count; ++i)
    points.emplace_back(Vector2(0.2, -0.1) + stretched * Vector2(normal(generator), normal(generator)));
  return points;
}

bool inside(const Ellipse& ellipse, const Vector2& point) {
  const Vector2 along = rotation(-ellipse.angle_rad) * (point - ellipse.centre);
  return std::hypot(along.x() / ellipse.semi_major_m, along.y() / ellipse.semi_minor_m) <= 1.0;
}

TEST(Scatter, WithoutPointsHasNeitherCentreNorEllipse) {
  const Scatter scatter = scatter_of({});
  EXPECT_EQ(scatter.count, 0);
  EXPECT_EQ(scatter.centroid, Vector2::Zero());
  EXPECT_FALSE(scatter.ellipse95);
}

TEST(Scatter, DrawsNoEllipseAroundFewPoints) {
  std::mt19937 generator(1);
  EXPECT_FALSE(scatter_of(gaussian_points(kFewestForEllipse - 1, generator)).ellipse95);
  EXPECT_TRUE(scatter_of(gaussian_points(kFewestForEllipse, generator)).ellipse95);
}

TEST(Scatter, CentroidIsTheMean) {
  const std::vector<Vector2> points = {{1.0, 2.0}, {3.0, -2.0}, {5.0, 3.0}};
  EXPECT_TRUE(scatter_of(points).centroid.isApprox(Vector2(3.0, 1.0)));
}

TEST(Scatter, PointsInOneLineGiveAFlatEllipseAlongIt) {
  std::vector<Vector2> points;
  for (int i = 0; i < 6; ++i) points.emplace_back(i, 2.0 * i);
  const Ellipse ellipse = scatter_of(points).ellipse95.value();
  EXPECT_NEAR(ellipse.angle_rad, std::atan2(2.0, 1.0), 1e-9);
  EXPECT_NEAR(ellipse.semi_minor_m, 0.0, 1e-6);
}

TEST(Scatter, EqualPointsGiveAnEllipseOfNoSize) {
  const std::vector<Vector2> points(7, Vector2(0.3, 0.4));
  const Ellipse ellipse = scatter_of(points).ellipse95.value();
  EXPECT_NEAR(ellipse.semi_major_m, 0.0, 1e-12);
  EXPECT_NEAR(ellipse.semi_minor_m, 0.0, 1e-12);
}

/// Each trial: an ellipse from n points, then one further point. Hits are binomial with p = 0.95; the limits
/// are its 4σ band over 20000 trials, ±0.0062.
class ScatterCoverage : public testing::TestWithParam<int> {};

TEST_P(ScatterCoverage, AFurtherPointIsInsideIn95Percent) {
  constexpr int kTrials = 20000;
  std::mt19937 generator(17);
  int hits = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::vector<Vector2> points = gaussian_points(GetParam(), generator);
    hits += inside(scatter_of(points).ellipse95.value(), gaussian_points(1, generator).front()) ? 1 : 0;
  }
  const double limit = 4.0 * std::sqrt(0.95 * 0.05 / kTrials);
  EXPECT_NEAR(static_cast<double>(hits) / kTrials, 0.95, limit);
}

INSTANTIATE_TEST_SUITE_P(Counts, ScatterCoverage, testing::Values(5, 6, 10, 25));

}  // namespace
}  // namespace trundle::report
