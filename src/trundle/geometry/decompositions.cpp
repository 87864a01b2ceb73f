#include "trundle/geometry/decompositions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>

namespace trundle::geometry {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace

SymmetricEigen symmetric_eigen(const MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(A);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

VectorXd symmetric_eigenvalues(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

MatrixXd inverse_square_root(const MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(A).operatorInverseSqrt();
}

RightSingularVectors right_singular_vectors(const MatrixXd& A) {
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixV()};
}

Index rank_of(const MatrixXd& A, std::optional<double> threshold) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  if (threshold) qr.setThreshold(*threshold);
  return qr.rank();
}

MatrixXd orthogonal_complement(const MatrixXd& A) {
  const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(A).householderQ();
  return Q.rightCols(A.rows() - A.cols());
}

MatrixXd left_null_space(const MatrixXd& A, double threshold) {
  Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  qr.setThreshold(threshold);
  const MatrixXd Q = qr.householderQ();
  return Q.rightCols(A.rows() - qr.rank());
}

MatrixXd pseudo_inverse(const MatrixXd& A) {
  return A.completeOrthogonalDecomposition().pseudoInverse();
}

VectorXd least_squares(const MatrixXd& A, const VectorXd& b) {
  return A.colPivHouseholderQr().solve(b);
}

VectorXd solve_ldlt(const MatrixXd& A, const VectorXd& b) {
  return A.ldlt().solve(b);
}

MatrixXd solve_ldlt_columns(const MatrixXd& A, const MatrixXd& B) {
  return A.ldlt().solve(B);
}

MatrixXd divide_ldlt(const MatrixXd& B, const MatrixXd& A) {
  return A.ldlt().solve(B.transpose()).transpose();
}

MatrixXd divide_cholesky(const MatrixXd& B, const MatrixXd& A) {
  return A.llt().solve(B.transpose()).transpose();
}

bool is_positive_definite(const MatrixXd& A) {
  return A.llt().info() == Eigen::Success;
}

bool is_positive_semidefinite(const MatrixXd& A) {
  return A.ldlt().isPositive();
}

std::optional<GaussianMisfit> gaussian_misfit(const VectorXd& b, const MatrixXd& A) {
  const Eigen::LLT<MatrixXd> cholesky(A);
  if (cholesky.info() != Eigen::Success) return std::nullopt;
  return GaussianMisfit{cholesky.matrixL().solve(b).squaredNorm(),
                        2.0 * cholesky.matrixLLT().diagonal().array().log().sum()};
}

bool eliminate_columns(MatrixXd& A, Index columns) {
  const Index rows = A.rows() - columns;
  Eigen::Ref<MatrixXd> A11 = A.topLeftCorner(columns, columns);
  const Eigen::LLT<Eigen::Ref<MatrixXd>> L1(A11);
  if (L1.info() != Eigen::Success) return false;
  if (rows == 0) return true;
  auto L2 = A.bottomLeftCorner(rows, columns);
  A11.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(L2);
  A.bottomRightCorner(rows, rows).selfadjointView<Eigen::Lower>().rankUpdate(L2, -1.0);
  return true;
}

MatrixXd congruent(const MatrixXd& A, const MatrixXd& B) {
  return B.transpose() * A * B;
}

MatrixXd inverse_of(const MatrixXd& A) {
  return A.inverse();
}

}  // namespace trundle::geometry
