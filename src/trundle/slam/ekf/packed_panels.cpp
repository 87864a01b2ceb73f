#include "trundle/slam/ekf/packed_panels.hpp"

#include <algorithm>
#include <cassert>

#include "trundle/slam/ekf/panel_kernels.hpp"

namespace trundle::slam {
namespace {
using Index = Eigen::Index;
}

double* PackedPanels::shape(Index rows, Index columns) {
  panels_ = whole_panels(rows) / kRows;
  columns_ = columns;
  const auto size = static_cast<std::size_t>(panels_ * kRows * columns_);
  if (numbers_.size() < size) numbers_.resize(2 * size);
  return numbers_.data();
}

void PackedPanels::assign_sums(const Eigen::MatrixXd& matrix, Index rows, std::span<const Sum> sums) {
  double* to = shape(rows, static_cast<Index>(sums.size()));
  assert(matrix.rows() >= panels_ * kRows);
  sum_panels(matrix.data(), matrix.rows(), panels_, sums, to);
}

void PackedPanels::divide_by(const Eigen::Ref<const Eigen::MatrixXd>& L) {
  assert(L.rows() == columns_);
  divide_panels(L.data(), L.outerStride(), panels_, columns_, numbers_.data());
}

void PackedPanels::add_product_to(Eigen::VectorXd& y, const double* v) const {
  assert(y.size() >= panels_ * kRows);
  add_panels(numbers_.data(), panels_, columns_, v, y.data());
}

void PackedPanels::pack(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  double* to = shape(matrix.rows(), matrix.cols());
  for (Index row = 0; row < matrix.rows(); row += kRows) {
    const Index rows = std::min(kRows, matrix.rows() - row);
    for (Index k = 0; k < columns_; ++k, to += kRows) {
      const double* from = matrix.data() + row + k * matrix.outerStride();
      for (Index i = 0; i < kRows; ++i) to[i] = i < rows ? from[i] : 0.0;
    }
  }
}

void subtract_product(const PackedPanels& A, const PackedPanels& B, Part part, Eigen::MatrixXd& C) {
  assert(A.columns() == B.columns());
  assert(C.rows() >= A.panels() * PackedPanels::kRows && C.cols() >= B.panels() * PackedPanels::kRows);
  if (A.panels() == 0 || B.panels() == 0) return;
  subtract_panels({A.panel(0), B.panel(0), A.panels(), B.panels(), A.columns(), part == Part::lower},
                  C.data(), C.rows());
}

}  // namespace trundle::slam
