/// Decompositions and products of matrices whose size is known at run time: all that the modules need,
/// compiled once. Each costs the compiler seconds wherever it is used by itself.
#pragma once

#include <optional>

#include <Eigen/Core>

namespace trundle::geometry {

/// A = V diag(values) Vᵀ.
struct SymmetricEigen {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< V: orthonormal columns
};
/// Of A (n×n), of which the lower triangle is read.
[[nodiscard]] SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);
/// The eigenvalues alone, ascending, of A (n×n), of which the lower triangle is read.
[[nodiscard]] Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A);
/// The symmetric A^(-1/2) of a positive definite A (n×n); not finite where A is singular.
[[nodiscard]] Eigen::MatrixXd inverse_square_root(const Eigen::MatrixXd& A);

/// A = U diag(values) Vᵀ without U.
struct RightSingularVectors {
  Eigen::VectorXd values;   ///< min(m, n) of them, descending
  Eigen::MatrixXd vectors;  ///< V (n×n): orthonormal columns
};
/// Of A (m×n).
[[nodiscard]] RightSingularVectors right_singular_vectors(const Eigen::MatrixXd& A);

/// The rank of A (m×n): pivots of at most `threshold` times the largest are rounding; without, Eigen's own.
[[nodiscard]] Eigen::Index rank_of(const Eigen::MatrixXd& A, std::optional<double> threshold = std::nullopt);
/// Orthonormal columns (m×(m−n)), orthogonal to those of A (m×n) of rank n.
[[nodiscard]] Eigen::MatrixXd orthogonal_complement(const Eigen::MatrixXd& A);
/// Orthonormal columns (m×(m−r)), orthogonal to those of A (m×n) of rank r: pivots of at most `threshold`
/// times the largest are rounding.
[[nodiscard]] Eigen::MatrixXd left_null_space(const Eigen::MatrixXd& A, double threshold);
/// The Moore–Penrose inverse (n×m) of A (m×n), of whatever rank.
[[nodiscard]] Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& A);
/// x (n) with the least ‖A x − b‖, of A (m×n) and b (m).
[[nodiscard]] Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// x with A x = b, of a symmetric semidefinite A (n×n) and b (n); with several b (n×m) as columns.
[[nodiscard]] Eigen::VectorXd solve_ldlt(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
[[nodiscard]] Eigen::MatrixXd solve_ldlt_columns(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// B A⁻¹ (m×n), of a symmetric semidefinite A (n×n) and B (m×n); by Cholesky of a positive definite A.
[[nodiscard]] Eigen::MatrixXd divide_ldlt(const Eigen::MatrixXd& B, const Eigen::MatrixXd& A);
[[nodiscard]] Eigen::MatrixXd divide_cholesky(const Eigen::MatrixXd& B, const Eigen::MatrixXd& A);
/// Whether the symmetric A (n×n), of which the lower triangle is read, has a Cholesky factor.
[[nodiscard]] bool is_positive_definite(const Eigen::MatrixXd& A);
/// Whether the symmetric A (n×n), of which the lower triangle is read, has no negative pivot.
[[nodiscard]] bool is_positive_semidefinite(const Eigen::MatrixXd& A);
/// What b (n) is worth where its covariance is A (n×n).
struct GaussianMisfit {
  double squared_mahalanobis = 0.0;  ///< bᵀ A⁻¹ b
  double log_determinant = 0.0;      ///< log |A|
};
/// Nothing where A is not positive definite.
[[nodiscard]] std::optional<GaussianMisfit> gaussian_misfit(const Eigen::VectorXd& b,
                                                            const Eigen::MatrixXd& A);

/// Eliminates the first `columns` rows and columns of a symmetric A (n×n), of which the lower triangle is
/// read and overwritten: A = [L1 0; L2 I] [I 0; 0 S] [L1ᵀ L2ᵀ; 0 I], with L1 lower triangular over L2 in the
/// first columns and the Schur complement S below and right of them. False, and A is of no use any more,
/// where what is eliminated is not positive definite.
[[nodiscard]] bool eliminate_columns(Eigen::MatrixXd& A, Eigen::Index columns);

/// Bᵀ A B (m×m): the quadratic form of A (n×n) in coordinates along the columns of B (n×m).
[[nodiscard]] Eigen::MatrixXd congruent(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// A⁻¹ (n×n), by LU; not finite where A is singular.
[[nodiscard]] Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& A);

}  // namespace trundle::geometry
