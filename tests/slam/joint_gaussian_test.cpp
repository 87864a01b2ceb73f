#include "trundle/slam/ekf/joint_gaussian.hpp"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "trundle/slam/ekf/ekf.hpp"

#include "slam/dense_ekf.hpp"
#include "slam/world.hpp"

namespace trundle::slam {
namespace {

using Index = Eigen::Index;

// Many more landmarks than are active at once, so that they come and go and all is settled many times.
test::SlamWorld large_world(std::uint64_t seed) {
  return test::slam_world({.steps = 260, .landmarks = 150, .radius_m = 25.0, .step_m = 1.0, .seed = seed});
}

TEST(JointGaussian, IsExactWhateverIsActive) {
  const test::SlamWorld world = large_world(2);
  EkfSlam filter(world.sensor, {.gate = 1e300});
  test::DenseEkf dense{world.sensor, Vector3::Zero(), Matrix3::Zero()};
  for (std::size_t k = 0; k < world.steps.size(); ++k) {
    filter.step(world.steps[k].motion, world.steps[k].observations);
    dense.step(world.steps[k]);
    ASSERT_LT((filter.estimate().pose.translation() - dense.x.head<2>()).norm(), 1e-9);
    if (k % 40 != 0) continue;
    // Single landmarks, most of them passive, and all together.
    for (std::size_t i = 0; i < filter.landmarks(); ++i) {
      const MappedLandmark m = filter.landmark(i);
      const Index at = dense.at.at(m.id);
      ASSERT_LT((m.position - dense.x.segment<2>(at)).norm(), 1e-8);
      ASSERT_LT((m.covariance - dense.P.block<2, 2>(at, at)).norm(), 1e-8 * (1e-4 + m.covariance.norm()));
    }
    const Eigen::MatrixXd P = filter.covariance();
    ASSERT_EQ(P.rows(), dense.P.rows());
    const Index rest = dense.P.rows() - 3;
    ASSERT_LT((P.bottomRightCorner(rest, rest) - dense.P.bottomRightCorner(rest, rest)).norm(),
              1e-8 * dense.P.norm());
    ASSERT_LT((P.bottomLeftCorner(rest, 3) - dense.P.bottomLeftCorner(rest, 3)).norm(),
              1e-8 * dense.P.norm());
  }
  EXPECT_GT(filter.landmarks(), 100U);
}

/// Landmark i stands at (i, −i), with some covariance with all others through the pose.
JointGaussian some_gaussian(std::size_t landmarks) {
  JointGaussian gaussian(
      {{0.5, 0.2, 0.1}, Vector3(0.3, 0.2, 0.1).asDiagonal(), Systematic::Constant(3, 0.1)});
  for (std::size_t i = 0; i < landmarks; ++i) {
    const auto x = static_cast<double>(i);
    Matrix23 by_pose;
    by_pose << 1.0, 0.0, x, 0.0, 1.0, -0.5 * x;
    gaussian.append({x, -x}, by_pose, (1.0 + x) * 0.01 * Matrix2::Identity());
  }
  return gaussian;
}

TEST(JointGaussian, RemovingALandmarkIsMarginalising) {
  for (const std::size_t gone : {std::size_t{0}, std::size_t{3}, std::size_t{6}}) {
    JointGaussian gaussian = some_gaussian(7);
    const Eigen::MatrixXd before = gaussian.covariance();
    gaussian.remove(gone);
    std::vector<Index> kept = {0, 1, 2, 3, 4, 5};
    for (std::size_t i = 0; i < 6; ++i) {
      const std::size_t was = i == gone ? 6 : i;  // the last takes its number
      EXPECT_EQ(gaussian.landmark(i).x(), static_cast<double>(was));
      kept.insert(kept.end(), {6 + 2 * static_cast<Index>(was), 7 + 2 * static_cast<Index>(was)});
    }
    EXPECT_EQ(gaussian.covariance(), Eigen::MatrixXd(before(kept, kept)));
    EXPECT_EQ(gaussian.landmarks(), 6U);
  }
}

TEST(JointGaussian, OneAddedAfterARemovalKnowsNothingOfIt) {
  JointGaussian gaussian = some_gaussian(5);
  gaussian.remove(4);
  Matrix23 by_pose;
  by_pose << 1.0, 0.0, 4.0, 0.0, 1.0, -2.0;
  gaussian.append({4.0, -4.0}, by_pose, 0.05 * Matrix2::Identity());
  EXPECT_LT((gaussian.covariance() - some_gaussian(5).covariance()).norm(), 1e-12);
}

TEST(PackedPanels, SubtractProductsOfAnyShape) {
  for (const Index rows : {1, 7, 8, 21})
    for (const Index columns : {1, 5, 16}) {
      const Eigen::MatrixXd A = Eigen::MatrixXd::Random(rows, columns);
      const Eigen::MatrixXd B = Eigen::MatrixXd::Random(rows, columns);
      const Index size = whole_panels(rows);
      Eigen::MatrixXd C = Eigen::MatrixXd::Random(size, size);
      const Eigen::MatrixXd expected = C.topLeftCorner(rows, rows) - A * B.transpose();
      Eigen::MatrixXd lower = C;
      PackedPanels a, b;
      a.pack(A);
      b.pack(B);
      subtract_product(a, b, Part::all, C);
      EXPECT_LT((C.topLeftCorner(rows, rows) - expected).norm(), 1e-12);
      subtract_product(a, b, Part::lower, lower);
      const Eigen::MatrixXd difference = lower.topLeftCorner(rows, rows) - expected;
      EXPECT_LT(Eigen::MatrixXd(difference.triangularView<Eigen::Lower>()).norm(), 1e-12);
    }
}

TEST(PackedPanels, DivideByATriangle) {
  Eigen::MatrixXd L = Eigen::MatrixXd::Random(6, 6).triangularView<Eigen::Lower>();
  L.diagonal().array() += 3.0;
  const Eigen::MatrixXd X = Eigen::MatrixXd::Random(11, 6);
  PackedPanels panels;
  panels.pack(X);
  panels.divide_by(L);
  Eigen::MatrixXd quotient(11, 6);
  for (Index i = 0; i < 11; ++i)
    for (Index k = 0; k < 6; ++k) quotient(i, k) = panels(i, k);
  EXPECT_LT((quotient * L.transpose() - X).norm(), 1e-12);
}

TEST(PackedPanels, EveryInstructionSetGivesTheSameBits) {
  const Eigen::MatrixXd X = Eigen::MatrixXd::Random(24, 6);
  const Eigen::MatrixXd start = Eigen::MatrixXd::Random(24, 24);
  const Eigen::MatrixXd L = Eigen::MatrixXd::Identity(3, 3) + 0.1 * Eigen::MatrixXd::Random(3, 3);
  const std::array<PackedPanels::Sum, 3> sums = {{{{0, 1, 2, 3, 4}, {0.1, 0.2, -0.3, 0.4, 0.5}},
                                                  {{5, 1, 2, 3, 4}, {0.7, 0.2, 0.3, 0.4, -0.5}},
                                                  {{0, 1, 9, 3, 7}, {0.1, -0.2, 0.3, 0.9, 0.5}}}};
  std::vector<Eigen::MatrixXd> products;
  std::vector<Eigen::VectorXd> added;
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    PackedPanels panels;
    panels.pack(X);
    subtract_product(panels, panels, Part::all, products.emplace_back(start));
    panels.assign_sums(start, 24, sums);
    panels.divide_by(L);
    panels.add_product_to(added.emplace_back(start.col(0)), L.data());
    hwy::SetSupportedTargetsForTest(0);
    EXPECT_EQ(products.back(), products.front()) << hwy::TargetName(target);
    EXPECT_EQ(added.back(), added.front()) << hwy::TargetName(target);
  }
}

}  // namespace
}  // namespace trundle::slam
