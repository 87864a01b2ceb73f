#include "trundle/slam/ekf/strips.hpp"

#include <algorithm>
#include <cassert>

#include "trundle/slam/ekf/strip_kernels.hpp"

namespace trundle {
namespace {
using Index = Eigen::Index;
}

double* Strips::shape(Index rows, Index columns) {
  strips_ = whole_strips(rows) / kRows;
  columns_ = columns;
  const auto size = static_cast<std::size_t>(strips_ * kRows * columns_);
  if (numbers_.size() < size) numbers_.resize(2 * size);
  return numbers_.data();
}

void Strips::assign_sums(const Eigen::MatrixXd& matrix, Index rows, std::span<const Sum> sums) {
  double* to = shape(rows, static_cast<Index>(sums.size()));
  assert(matrix.rows() >= strips_ * kRows);
  sum_strips(matrix.data(), matrix.rows(), strips_, sums, to);
}

void Strips::divide_by(const Eigen::Ref<const Eigen::MatrixXd>& L) {
  assert(L.rows() == columns_);
  divide_strips(L.data(), L.outerStride(), strips_, columns_, numbers_.data());
}

void Strips::add_product_to(Eigen::VectorXd& y, const double* v) const {
  assert(y.size() >= strips_ * kRows);
  add_strips(numbers_.data(), strips_, columns_, v, y.data());
}

void Strips::pack(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  double* to = shape(matrix.rows(), matrix.cols());
  for (Index row = 0; row < matrix.rows(); row += kRows) {
    const Index rows = std::min(kRows, matrix.rows() - row);
    for (Index k = 0; k < columns_; ++k, to += kRows) {
      const double* from = matrix.data() + row + k * matrix.outerStride();
      for (Index i = 0; i < kRows; ++i) to[i] = i < rows ? from[i] : 0.0;
    }
  }
}

void subtract_product(const Strips& A, const Strips& B, Part part, Eigen::MatrixXd& C) {
  assert(A.columns() == B.columns());
  assert(C.rows() >= A.strips() * Strips::kRows && C.cols() >= B.strips() * Strips::kRows);
  if (A.strips() == 0 || B.strips() == 0) return;
  subtract_strips({A.strip(0), B.strip(0), A.strips(), B.strips(), A.columns(), part == Part::lower},
                  C.data(), C.rows());
}

}  // namespace trundle
