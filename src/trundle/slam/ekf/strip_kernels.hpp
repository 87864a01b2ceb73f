#pragma once

#include <span>

#include "trundle/slam/ekf/strips.hpp"

namespace trundle {

// The arithmetic of Strips, with the same bits on every machine.

/// A, B of C ← C − A Bᵀ: so many strips of so many columns.
struct StripFactors {
  const double* a;
  const double* b;
  Eigen::Index a_strips;
  Eigen::Index b_strips;
  Eigen::Index columns;
  bool lower;
};
void subtract_strips(const StripFactors& factors, double* c, Eigen::Index stride);
void sum_strips(const double* matrix, Eigen::Index stride, Eigen::Index strips,
                std::span<const Strips::Sum> sums, double* to);
/// Forward substitution.
void divide_strips(const double* L, Eigen::Index stride, Eigen::Index strips, Eigen::Index columns,
                   double* x);
void add_strips(const double* x, Eigen::Index strips, Eigen::Index columns, const double* v, double* y);

}  // namespace trundle
