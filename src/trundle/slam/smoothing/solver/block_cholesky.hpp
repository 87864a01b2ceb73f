#pragma once

#include <Eigen/Core>

#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/elimination.hpp"

namespace trundle::slam {

/// A symmetric, positive definite matrix of small blocks, most of them zero, and its Cholesky factor. The
/// factor is a tree of dense fronts (multifrontal), so that all arithmetic is dense; of the inverse those
/// blocks are computed whose block in the factor is not zero, from the root down. docs/theory/smoother.md,
/// eq. 9-11. One pattern, factored anew for each damping; where the pattern itself grows and little of it
/// changes at a time: EliminationTree, over the same fronts.
class BlockCholesky {
 public:
  explicit BlockCholesky(const BlockPattern& pattern);

  [[nodiscard]] Eigen::Index size() const { return size_; }
  /// Where a block begins in a vector.
  [[nodiscard]] Eigen::Index offset(int block) const { return offset_[nth(block)]; }

  /// Sets the matrix to zero.
  void clear();
  /// Adds to the block (i, j) and, being symmetric, to (j, i). Of i = j the lower triangle counts.
  void add(int i, int j, const Eigen::Ref<const Eigen::MatrixXd>& block);

  /// Factors matrix + damping · I. False: it is not positive definite.
  bool factor(double damping);
  /// After factor(): x with (matrix + damping · I) x = b.
  [[nodiscard]] Eigen::VectorXd solve(Eigen::VectorXd b) const;

  /// After factor(): computes the inverse's blocks.
  void invert();
  /// After invert(): the block (i, j) of the inverse, of blocks that are the same or coupled.
  [[nodiscard]] Eigen::MatrixXd inverse(int i, int j) const;

 private:
  struct Place {
    std::size_t front;
    int offset;
    int rows;
  };
  [[nodiscard]] int row_in(const Front& front, int block) const;
  bool factor_front(std::size_t f, double damping);

  Eigen::Index size_ = 0;
  std::vector<Eigen::Index> offset_;  ///< by block
  std::vector<Place> place_;          ///< by block: its columns
  std::vector<int> order_;            ///< by block: when it is eliminated
  std::vector<Front> fronts_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<Eigen::MatrixXd> matrix_;   ///< by front: its columns of the matrix, below the diagonal
  std::vector<Eigen::MatrixXd> factor_;   ///< the same of the factor
  std::vector<Eigen::MatrixXd> updates_;  ///< what eliminating a front's columns does to its rows
  std::vector<Eigen::MatrixXd> inverse_;  ///< by front: its columns of the inverse
};

}  // namespace trundle::slam
