// What is left of terms that are not kept, against the same algebra done densely.
#include "trundle/slam/smoothing/solver/marginal_prior.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "trundle/geometry/pose2.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using PriorKind = MarginalPrior::Kind;

/// What it adds to a system of variables 0, 1, ... of given sizes.
struct Dense {
  explicit Dense(const MarginalPrior& prior, const std::vector<int>& sizes) {
    std::vector<int> offset;
    int total = 0;
    for (const int size : sizes) {
      offset.push_back(total);
      total += size;
    }
    matrix = MatrixXd::Zero(total, total);
    right = VectorXd::Zero(total);
    FrontSystem system(matrix, right, offset);
    prior.add_to(system);
    matrix = MatrixXd(matrix.selfadjointView<Eigen::Lower>());
  }
  MatrixXd matrix;
  VectorXd right;
};

const std::vector<int> kSizes = {2, 2, 2, 3};  // three landmarks and a pose

VectorXd place_of_unknown(int variable) {
  switch (variable) {
    case 0:
      return Vector2(1.0, 2.0);
    case 1:
      return Vector2(-3.0, 0.5);
    case 2:
      return Vector2(4.0, -1.0);
    default:
      return Vector3(0.5, -0.5, 0.7);
  }
}

MarginalPrior any_prior(std::uint64_t seed, const MatrixXd& J, double off = 1.0) {
  Random random(seed, 5);
  const VectorXd b = VectorXd::NullaryExpr(9, [&] { return off * random.normal(1.0); });
  std::vector<MarginalPrior::Unknown> unknowns;
  for (int variable = 0; variable < 4; ++variable)
    unknowns.push_back(
        {variable, variable < 3 ? PriorKind::landmark : PriorKind::pose, place_of_unknown(variable)});
  return {unknowns, J.transpose() * J, J.transpose() * (J * b)};
}

MatrixXd any_matrix(std::uint64_t seed, Index rows, Index columns) {
  Random random(seed, 6);
  return MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(1.0); });
}

// Of landmarks as the pose sees them, by moves of all: what does not change when all are moved together.
MatrixXd relative_jacobian() {
  MatrixXd J = MatrixXd::Zero(6, 9);
  const VectorXd pose = place_of_unknown(3);
  const Matrix2 back = rotation(-pose[2]);
  for (Index k = 0; k < 3; ++k) {
    J.block<2, 2>(2 * k, 2 * k) = back;
    const Vector2 seen = back * (place_of_unknown(static_cast<int>(k)) - pose.head<2>());
    J.block<2, 3>(2 * k, 6) << -1.0, 0.0, seen.y(), 0.0, -1.0, -seen.x();
  }
  return J;
}

TEST(MarginalPrior, MovesWithItsLandmarks) {
  const MarginalPrior prior = any_prior(1, any_matrix(2, 6, 6) * relative_jacobian());
  const Pose2 moved{7.0, -4.0, 1.1};
  const MarginalPrior there = prior.at([&](int variable) -> VectorXd {
    const VectorXd value = place_of_unknown(variable);
    const Vector2 place = moved * Vector2(value.head<2>());
    if (variable < 3) return place;
    return Vector3(place.x(), place.y(), value[2] + moved.heading);
  });
  MatrixXd turn = MatrixXd::Identity(9, 9);  // moves of the pose are in its own axes
  for (Index k = 0; k < 3; ++k) turn.block<2, 2>(2 * k, 2 * k) = rotation(moved.heading);
  const Dense before(prior, kSizes), after(there, kSizes);
  EXPECT_LT((after.matrix - turn * before.matrix * turn.transpose()).norm(), 1e-9 * before.matrix.norm());
  EXPECT_LT((after.right - turn * before.right).norm(), 1e-9 * before.right.norm());
}

// Small moves of each by itself, of a prior that knows where the world is: as of any quadratic, at its least.
TEST(MarginalPrior, IsTheSameAboutAnotherPoint) {
  const MarginalPrior prior = any_prior(3, any_matrix(4, 9, 9), 0.0);
  const VectorXd by = 1e-5 * any_matrix(5, 9, 1);
  const MarginalPrior there = prior.at([&](int variable) -> VectorXd {
    VectorXd value = place_of_unknown(variable);
    if (variable < 3) return value + by.segment<2>(2 * variable);
    value.head<2>() += rotation(value[2]) * by.segment<2>(6);
    value[2] += by[8];
    return value;
  });
  const Dense before(prior, kSizes), after(there, kSizes);
  EXPECT_LT((after.right - (before.right - before.matrix * by)).norm(), 1e-4 * (before.matrix * by).norm());
}

TEST(MarginalPrior, IsWhatItSaysOfSomeAndOfTheOthersGivenThem) {
  const MarginalPrior prior = any_prior(6, any_matrix(7, 12, 9));
  const MarginalPrior both = prior.conditional({1, 3}).with(prior.marginalised({3, 1}));
  const Dense expected(prior, kSizes), found(both, kSizes);
  EXPECT_LT((found.matrix - expected.matrix).norm(), 1e-12 * expected.matrix.norm());
  EXPECT_LT((found.right - expected.right).norm(), 1e-12 * expected.right.norm());
  const Dense rest(prior.marginalised({3}), kSizes);
  const MatrixXd marginal = expected.matrix.inverse().topLeftCorner<6, 6>().inverse();
  EXPECT_LT((rest.matrix.topLeftCorner<6, 6>() - marginal).norm(), 1e-9 * marginal.norm());
}

// A pose after the next, by a motion of which one direction is a million times surer than anything else.
TEST(MarginalPrior, MovesOnToTheNextPose) {
  const MarginalPrior prior = any_prior(8, any_matrix(9, 12, 9));
  const Eigen::Matrix3d by_from = any_matrix(10, 3, 3), by_to = any_matrix(11, 3, 3);
  const VectorXd error = any_matrix(12, 3, 1);
  const MatrixXd W = Vector3(4.0, 1e12, 25.0).asDiagonal();
  const MarginalPrior next = prior.moved_on({.from = 3,
                                             .to = {4, PriorKind::pose, place_of_unknown(3)},
                                             .parameters = {},
                                             .error = error,
                                             .by_from = by_from,
                                             .by_to = by_to,
                                             .by_parameters = MatrixXd(3, 0),
                                             .information = W});
  // δ_to = −by_to⁻¹ (by_from δ_from + error − e): mean and covariance follow.
  const Dense before(prior, kSizes);
  const MatrixXd P = before.matrix.inverse();
  const VectorXd mean = P * before.right;
  MatrixXd F = MatrixXd::Identity(9, 9);
  F.bottomRightCorner<3, 3>() = -by_to.inverse() * by_from;
  MatrixXd expected = F * P * F.transpose();
  expected.bottomRightCorner<3, 3>() += by_to.inverse() * W.inverse() * by_to.inverse().transpose();
  VectorXd expected_mean = F * mean;
  expected_mean.tail<3>() -= by_to.inverse() * error;
  const Dense after(next, {2, 2, 2, 0, 3});
  EXPECT_LT((after.matrix.inverse() - expected).norm(), 1e-9 * expected.norm());
  EXPECT_LT((after.matrix.inverse() * after.right - expected_mean).norm(), 1e-9 * expected_mean.norm());
}

TEST(MarginalPrior, TwoLandmarksBecomeOne) {
  MarginalPrior prior = any_prior(13, any_matrix(14, 12, 9));
  const Dense before(prior, kSizes);
  prior.merge(0, 2);
  EXPECT_FALSE(prior.has(2));
  // δ of both are those of the first, and from the third's place.
  MatrixXd T = MatrixXd::Zero(9, 9);
  T.diagonal().setOnes();
  T.block<2, 2>(4, 4).setZero();
  T.block<2, 2>(4, 0).setIdentity();
  VectorXd offset = VectorXd::Zero(9);
  offset.segment<2>(4) = place_of_unknown(0) - place_of_unknown(2);
  const Dense after(prior, kSizes);
  EXPECT_LT((after.matrix - T.transpose() * before.matrix * T).norm(), 1e-12 * before.matrix.norm());
  EXPECT_LT((after.right - T.transpose() * (before.right - before.matrix * offset)).norm(),
            1e-12 * (before.right.norm() + before.matrix.norm()));
}

}  // namespace
}  // namespace trundle::slam
