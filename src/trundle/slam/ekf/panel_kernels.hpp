#pragma once

#include <span>

#include "trundle/slam/ekf/packed_panels.hpp"

namespace trundle::slam {

// The arithmetic of PackedPanels, with the same bits on every machine.

/// A, B of C ← C − A Bᵀ: so many panels of so many columns.
struct PanelFactors {
  const double* a;
  const double* b;
  Eigen::Index a_panels;
  Eigen::Index b_panels;
  Eigen::Index columns;
  bool lower;
};
void subtract_panels(const PanelFactors& factors, double* c, Eigen::Index stride);
void sum_panels(const double* matrix, Eigen::Index stride, Eigen::Index panels,
                std::span<const PackedPanels::Sum> sums, double* to);
/// Forward substitution.
void divide_panels(const double* L, Eigen::Index stride, Eigen::Index panels, Eigen::Index columns,
                   double* x);
void add_panels(const double* x, Eigen::Index panels, Eigen::Index columns, const double* v, double* y);

}  // namespace trundle::slam
