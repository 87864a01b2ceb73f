#include "trundle/geometry/decompositions.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trundle::geometry {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kClose = 1e-12;

/// 5×3 of rank 3; its last row repeats the first.
MatrixXd tall() {
  MatrixXd A(5, 3);
  A << 1.0, 0.5, -0.3, 1.0, -0.5, 0.2, 0.0, 2.0, 0.7, 0.4, 0.1, 1.0, 1.0, 0.5, -0.3;
  return A;
}
MatrixXd covariance() {
  return tall().transpose() * tall();
}

TEST(decompositions, eigenvectors_diagonalise_and_the_inverse_root_whitens) {
  const MatrixXd A = covariance();
  const SymmetricEigen eigen = symmetric_eigen(A);
  EXPECT_LT((eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose() - A).norm(), kClose);
  EXPECT_LT(eigen.values[0], eigen.values[2]);
  EXPECT_EQ(symmetric_eigenvalues(A).size(), 3);
  EXPECT_LT((symmetric_eigenvalues(A) - eigen.values).norm(), kClose);
  const MatrixXd root = inverse_square_root(A);
  EXPECT_LT((root * A * root - MatrixXd::Identity(3, 3)).norm(), kClose);
}

TEST(decompositions, singular_vectors_are_eigenvectors_of_the_normal_matrix) {
  const RightSingularVectors right = right_singular_vectors(tall());
  const MatrixXd squares = right.values.cwiseAbs2().asDiagonal();
  EXPECT_LT((right.vectors.transpose() * covariance() * right.vectors - squares).norm(), kClose);
  // Of fewer rows than columns all directions are there, those that no row sees last.
  const RightSingularVectors wide = right_singular_vectors(tall().topRows(2));
  EXPECT_EQ(wide.values.size(), 2);
  EXPECT_LT((tall().topRows(2) * wide.vectors.col(2)).norm(), kClose);
}

TEST(decompositions, rank_and_complement_of_repeated_rows) {
  MatrixXd twice(2, 3);
  twice << tall().row(0), tall().row(4);
  EXPECT_EQ(rank_of(tall()), 3);
  EXPECT_EQ(rank_of(twice), 1);
  twice(1, 0) += 1e-10;
  EXPECT_EQ(rank_of(twice), 2);
  EXPECT_EQ(rank_of(twice, 1e-9), 1);
  const MatrixXd N = orthogonal_complement(tall());
  EXPECT_LT((N.transpose() * N - MatrixXd::Identity(2, 2)).norm(), kClose);
  EXPECT_LT((N.transpose() * tall()).norm(), kClose);
}

TEST(decompositions, left_null_space_counts_repeated_columns_once) {
  MatrixXd A(5, 4);
  A << tall(), tall().col(0) - 2.0 * tall().col(2);
  const MatrixXd N = left_null_space(A, 1e-9);
  ASSERT_EQ(N.cols(), 2);
  EXPECT_LT((N.transpose() * N - MatrixXd::Identity(2, 2)).norm(), kClose);
  EXPECT_LT((N.transpose() * A).norm(), kClose);
  EXPECT_EQ(left_null_space(tall().topRows(3), 1e-9).cols(), 0);
}

TEST(decompositions, congruence_keeps_quadratic_forms) {
  const MatrixXd A = tall() * tall().transpose();
  const VectorXd x = VectorXd::LinSpaced(3, -1.0, 2.0);
  const VectorXd y = tall() * x;
  EXPECT_NEAR(x.dot(congruent(A, tall()) * x), y.dot(A * y), kClose * y.dot(A * y));
}

TEST(decompositions, solutions_solve) {
  const MatrixXd A = covariance();
  const VectorXd b = VectorXd::LinSpaced(5, -1.0, 2.0);
  const VectorXd x = least_squares(tall(), b);
  EXPECT_LT((tall().transpose() * (tall() * x - b)).norm(), kClose);
  EXPECT_LT((pseudo_inverse(tall()) * b - x).norm(), kClose);
  EXPECT_LT((A * solve_ldlt(A, x) - x).norm(), kClose);
  EXPECT_LT((A * solve_ldlt_columns(A, tall().transpose()) - tall().transpose()).norm(), kClose);
  EXPECT_LT((divide_ldlt(tall(), A) * A - tall()).norm(), kClose);
  EXPECT_LT((divide_cholesky(tall(), A) * A - tall()).norm(), kClose);
  EXPECT_LT((A * inverse_of(A) - MatrixXd::Identity(3, 3)).norm(), kClose);
}

TEST(decompositions, misfit_of_a_covariance_that_is_none) {
  const VectorXd b = VectorXd::LinSpaced(3, 1.0, 2.0);
  const auto misfit = gaussian_misfit(b, covariance());
  ASSERT_TRUE(misfit);
  EXPECT_NEAR(misfit->squared_mahalanobis, b.dot(inverse_of(covariance()) * b), kClose);
  EXPECT_NEAR(misfit->log_determinant, symmetric_eigenvalues(covariance()).array().log().sum(), kClose);
  MatrixXd negative = covariance();
  negative(1, 1) = -1.0;
  EXPECT_FALSE(gaussian_misfit(b, negative));
  EXPECT_FALSE(is_positive_definite(negative));
  EXPECT_TRUE(is_positive_definite(covariance()));
}

}  // namespace
}  // namespace trundle::geometry
