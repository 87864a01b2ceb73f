#pragma once

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/namespaces.hpp"

namespace trundle::slam {

/// Rows of a matrix in panels of eight, each panel's columns one after the other: what a product reads from
/// one end to the other. Rows beyond the last are zero.
class PackedPanels {
 public:
  static constexpr Eigen::Index kRows = 8;

  /// A column as a sum of five columns of another matrix.
  struct Sum {
    std::array<Eigen::Index, 5> columns;
    std::array<double, 5> weights;
  };

  void pack(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
  /// One column for each sum, of the first rows of a matrix, which has whole_panels() of them.
  void assign_sums(const Eigen::MatrixXd& matrix, Eigen::Index rows, std::span<const Sum> sums);
  /// X ← X L⁻ᵀ, L lower triangular with columns() rows.
  void divide_by(const Eigen::Ref<const Eigen::MatrixXd>& L);
  /// y ← y + X v; y has whole panels.
  void add_product_to(Eigen::VectorXd& y, const double* v) const;
  double operator()(Eigen::Index row, Eigen::Index column) const {
    return panel(row / kRows)[column * kRows + row % kRows];
  }
  [[nodiscard]] Eigen::Index panels() const { return panels_; }
  [[nodiscard]] Eigen::Index columns() const { return columns_; }
  [[nodiscard]] const double* panel(Eigen::Index i) const { return numbers_.data() + i * kRows * columns_; }

 private:
  double* shape(Eigen::Index rows, Eigen::Index columns);

  std::vector<double> numbers_;
  Eigen::Index panels_ = 0;
  Eigen::Index columns_ = 0;
};

/// Numbers of rows and columns that products write: whole panels.
constexpr Eigen::Index whole_panels(Eigen::Index rows) {
  return (rows + PackedPanels::kRows - 1) / PackedPanels::kRows * PackedPanels::kRows;
}

enum class Part { all, lower };  ///< lower: at least what is on and below the diagonal

/// C ← C − A Bᵀ, with the same bits on every machine. C has at least whole_panels() of both rows and columns.
void subtract_product(const PackedPanels& A, const PackedPanels& B, Part part, Eigen::MatrixXd& C);

}  // namespace trundle::slam
