#include "trundle/slam/smoothing/solver/block_cholesky.hpp"

#include <algorithm>
#include <cassert>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/slam/nth.hpp"

namespace trundle::slam {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// whole(map, map) += lower triangle of part
void add_at(const std::vector<int>& map, const MatrixXd& part, MatrixXd& whole) {
  const auto n = static_cast<Index>(map.size());
  for (Index j = 0; j < n; ++j) {
    const Index column = map[nth(j)];
    for (Index i = j; i < n; ++i) {
      const Index row = map[nth(i)];
      whole(std::max(row, column), std::min(row, column)) += part(i, j);
    }
  }
}

/// The symmetric part of `whole` (both triangles) at the map's rows and columns.
MatrixXd gather(const std::vector<int>& map, const MatrixXd& whole) {
  const auto n = static_cast<Index>(map.size());
  MatrixXd part(n, n);
  for (Index j = 0; j < n; ++j)
    for (Index i = 0; i < n; ++i) part(i, j) = whole(map[nth(i)], map[nth(j)]);
  return part;
}

}  // namespace

BlockCholesky::BlockCholesky(const BlockPattern& pattern)
    : place_(pattern.sizes.size()), order_(pattern.sizes.size()), fronts_(elimination_fronts(pattern)) {
  for (const int rows : pattern.sizes) {
    offset_.push_back(size_);
    size_ += rows;
  }
  const std::size_t count = fronts_.size();
  children_.resize(count);
  matrix_.resize(count);
  factor_.resize(count);
  updates_.resize(count);
  inverse_.resize(count);
  int turn = 0;
  for (std::size_t f = 0; f < count; ++f) {
    const Front& front = fronts_[f];
    if (front.parent >= 0) children_[nth(front.parent)].push_back(f);
    for (std::size_t i = 0; i < nth(front.column_blocks); ++i) {
      const auto block = nth(front.blocks[i]);
      place_[block] = {f, front.offset[i], pattern.sizes[block]};
      order_[block] = turn++;
    }
    matrix_[f] = MatrixXd::Zero(front.size, front.columns);
  }
}

void BlockCholesky::clear() {
  for (MatrixXd& columns : matrix_) columns.setZero();
}

int BlockCholesky::row_in(const Front& front, int block) const {
  const auto at = std::ranges::find(front.blocks, block);
  assert(at != front.blocks.end());
  return front.offset[nth(at - front.blocks.begin())];
}

void BlockCholesky::add(int i, int j, const Eigen::Ref<const MatrixXd>& block) {
  if (order_[nth(i)] < order_[nth(j)]) {
    add(j, i, block.transpose());
    return;
  }
  const Place& column = place_[nth(j)];
  const int row = row_in(fronts_[column.front], i);
  matrix_[column.front].block(row, column.offset, block.rows(), block.cols()) += block;
}

bool BlockCholesky::factor(double damping) {
  for (std::size_t f = 0; f < fronts_.size(); ++f)
    if (!factor_front(f, damping)) return false;
  return true;
}

// docs/theory/smoother.md, eq. 9.
bool BlockCholesky::factor_front(std::size_t f, double damping) {
  const Front& front = fronts_[f];
  const Index columns = front.columns;
  MatrixXd whole(front.size, front.size);
  whole.leftCols(columns) = matrix_[f];
  whole.bottomRightCorner(front.rows(), front.rows()).setZero();
  whole.topLeftCorner(columns, columns).diagonal().array() += damping;
  for (const std::size_t child : children_[f]) {
    add_at(fronts_[child].in_parent, updates_[child], whole);
    updates_[child].resize(0, 0);
  }
  if (!geometry::eliminate_columns(whole, columns)) return false;
  if (front.rows() > 0) updates_[f] = whole.bottomRightCorner(front.rows(), front.rows());
  factor_[f] = whole.leftCols(columns);
  return true;
}

VectorXd BlockCholesky::solve(VectorXd b) const {
  std::vector<VectorXd> part(fronts_.size());  // of each front: its columns, and what it does to its rows
  for (std::size_t f = 0; f < fronts_.size(); ++f) {
    const Front& front = fronts_[f];
    VectorXd& x = part[f];
    x = VectorXd::Zero(front.size);
    for (std::size_t i = 0; i < nth(front.column_blocks); ++i) {
      const auto block = nth(front.blocks[i]);
      x.segment(front.offset[i], place_[block].rows) = b.segment(offset_[block], place_[block].rows);
    }
    for (const std::size_t child : children_[f])
      for (Index i = 0; i < fronts_[child].rows(); ++i)
        x[fronts_[child].in_parent[nth(i)]] += part[child][fronts_[child].columns + i];
    auto y = x.head(front.columns);
    factor_[f].topRows(front.columns).triangularView<Eigen::Lower>().solveInPlace(y);
    x.tail(front.rows()).noalias() -= factor_[f].bottomRows(front.rows()) * y;
  }
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    VectorXd& x = part[f];
    for (Index i = 0; i < front.rows(); ++i)
      x[front.columns + i] = part[nth(front.parent)][front.in_parent[nth(i)]];
    auto y = x.head(front.columns);
    y.noalias() -= factor_[f].bottomRows(front.rows()).transpose() * x.tail(front.rows());
    factor_[f].topRows(front.columns).triangularView<Eigen::Lower>().transpose().solveInPlace(y);
    for (std::size_t i = 0; i < nth(front.column_blocks); ++i) {
      const auto block = nth(front.blocks[i]);
      b.segment(offset_[block], place_[block].rows) = x.segment(front.offset[i], place_[block].rows);
    }
  }
  return b;
}

// With G = L2 L1⁻¹: Σ21 = −Σ22 G, Σ11 = L1⁻ᵀ L1⁻¹ − Gᵀ Σ21. Eq. 11.
void BlockCholesky::invert() {
  std::vector<MatrixXd> whole(fronts_.size());
  std::vector<std::size_t> waiting(fronts_.size());
  for (std::size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    const MatrixXd& L = factor_[f];
    const Index rows = front.rows();
    const auto L1 = L.topRows(front.columns).triangularView<Eigen::Lower>();
    const MatrixXd L1_inverse = L1.solve(MatrixXd::Identity(front.columns, front.columns));
    MatrixXd sigma(front.size, front.size);
    auto s11 = sigma.topLeftCorner(front.columns, front.columns);
    s11.noalias() = L1_inverse.transpose() * L1_inverse;
    if (rows > 0) {
      const auto parent = nth(front.parent);
      sigma.bottomRightCorner(rows, rows) = gather(front.in_parent, whole[parent]);
      if (--waiting[parent] == 0) whole[parent].resize(0, 0);
      const MatrixXd G = L.bottomRows(rows) * L1_inverse;
      auto s21 = sigma.bottomLeftCorner(rows, front.columns);
      s21.noalias() = -(sigma.bottomRightCorner(rows, rows) * G);
      s11.noalias() -= G.transpose() * s21;
      sigma.topRightCorner(front.columns, rows) = s21.transpose();
    }
    inverse_[f] = sigma.leftCols(front.columns);
    waiting[f] = children_[f].size();
    if (waiting[f] > 0) whole[f] = std::move(sigma);
  }
}

MatrixXd BlockCholesky::inverse(int i, int j) const {
  if (order_[nth(i)] < order_[nth(j)]) return inverse(j, i).transpose();
  const Place& column = place_[nth(j)];
  const int row = row_in(fronts_[column.front], i);
  return inverse_[column.front].block(row, column.offset, place_[nth(i)].rows, column.rows);
}

}  // namespace trundle::slam
