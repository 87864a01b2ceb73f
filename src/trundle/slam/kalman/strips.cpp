#include "trundle/slam/kalman/strips.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "trundle/odometry/lanes.hpp"

// Lanes stay inside one kernel: how they would be passed between functions does not matter.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace trundle {
namespace {

using Index = Eigen::Index;
static_assert(Strips::kRows == kLanes);

/// Eight rows and four columns of C, which stay in registers.
TRUNDLE_INLINE void subtract_tile(const double* a, const double* b, Index columns, double* c, Index stride) {
  Lanes c0, c1, c2, c3;
  std::memcpy(&c0, c, sizeof c0);
  std::memcpy(&c1, c + stride, sizeof c1);
  std::memcpy(&c2, c + 2 * stride, sizeof c2);
  std::memcpy(&c3, c + 3 * stride, sizeof c3);
  for (Index k = 0; k < columns; ++k, a += Strips::kRows, b += Strips::kRows) {
    Lanes x;
    std::memcpy(&x, a, sizeof x);
    c0 -= x * b[0];
    c1 -= x * b[1];
    c2 -= x * b[2];
    c3 -= x * b[3];
  }
  std::memcpy(c, &c0, sizeof c0);
  std::memcpy(c + stride, &c1, sizeof c1);
  std::memcpy(c + 2 * stride, &c2, sizeof c2);
  std::memcpy(c + 3 * stride, &c3, sizeof c3);
}

struct Factors {
  const double* a;
  const double* b;
  Index a_strips;
  Index b_strips;
  Index columns;
  bool lower;
};

// Down the columns of C: what is written lies in memory in the same order.
TRUNDLE_KERNEL void subtract_all(const Factors& f, double* c, Index stride) {
  const Index size = Strips::kRows * f.columns;
  for (Index j = 0; j < f.b_strips; ++j)
    for (Index half = 0; half < 2; ++half)
      for (Index i = f.lower ? j : 0; i < f.a_strips; ++i)
        subtract_tile(f.a + i * size, f.b + j * size + 4 * half, f.columns,
                      c + Strips::kRows * i + (Strips::kRows * j + 4 * half) * stride, stride);
}

TRUNDLE_INLINE Lanes lanes_at(const double* from) {
  Lanes x;
  std::memcpy(&x, from, sizeof x);
  return x;
}

TRUNDLE_KERNEL void sum_columns(const double* matrix, Index stride, Index strips,
                                std::span<const Strips::Sum> sums, double* to) {
  for (Index i = 0; i < strips; ++i)
    for (const Strips::Sum& sum : sums) {
      const double* from = matrix + Strips::kRows * i;
      Lanes x = sum.weights[0] * lanes_at(from + sum.columns[0] * stride);
      for (std::size_t k = 1; k < sum.columns.size(); ++k)
        x += sum.weights[k] * lanes_at(from + sum.columns[k] * stride);
      std::memcpy(to, &x, sizeof x);
      to += Strips::kRows;
    }
}

/// Forward substitution, eight rows of X at once.
TRUNDLE_KERNEL void divide_all(const double* L, Index stride, Index strips, Index columns, double* x) {
  for (Index i = 0; i < strips; ++i, x += Strips::kRows * columns)
    for (Index k = 0; k < columns; ++k) {
      const Lanes y = lanes_at(x + Strips::kRows * k) * (1.0 / L[k + k * stride]);
      std::memcpy(x + Strips::kRows * k, &y, sizeof y);
      for (Index j = k + 1; j < columns; ++j) {
        const Lanes z = lanes_at(x + Strips::kRows * j) - y * L[j + k * stride];
        std::memcpy(x + Strips::kRows * j, &z, sizeof z);
      }
    }
}

TRUNDLE_KERNEL void add_all(const double* x, Index strips, Index columns, const double* v, double* y) {
  for (Index i = 0; i < strips; ++i, y += Strips::kRows) {
    Lanes sum = lanes_at(y);
    for (Index k = 0; k < columns; ++k, x += Strips::kRows) sum += v[k] * lanes_at(x);
    std::memcpy(y, &sum, sizeof sum);
  }
}

}  // namespace

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
  sum_columns(matrix.data(), matrix.rows(), strips_, sums, to);
}

void Strips::divide_by(const Eigen::Ref<const Eigen::MatrixXd>& L) {
  assert(L.rows() == columns_);
  divide_all(L.data(), L.outerStride(), strips_, columns_, numbers_.data());
}

void Strips::add_product_to(Eigen::VectorXd& y, const double* v) const {
  assert(y.size() >= strips_ * kRows);
  add_all(numbers_.data(), strips_, columns_, v, y.data());
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
  subtract_all({A.strip(0), B.strip(0), A.strips(), B.strips(), A.columns(), part == Part::lower}, C.data(),
               C.rows());
}

}  // namespace trundle
