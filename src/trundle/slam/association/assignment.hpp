#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/namespaces.hpp"

namespace trundle::slam {

/// Which column each row gets, no column twice, so that the sum of the costs is least: the Hungarian method
/// [Kuhn 1955], O(rows² · columns). For many problems, one after the other: those of one size need no new
/// memory.
class CheapestAssignment {
 public:
  /// Column of each row, until the next call. At least as many columns as rows; finite costs.
  const std::vector<Eigen::Index>& solve(const Eigen::MatrixXd& cost);

 private:
  using Index = Eigen::Index;
  void assign(Index first, const Eigen::MatrixXd& cost);
  void raise_prices(Index first, double reached);
  void augment(Index first, Index column);

  std::vector<Index> column_of_;  ///< by row
  std::vector<Index> row_of_;     ///< by column
  // Dual variables.
  std::vector<double> row_price_;
  std::vector<double> column_price_;
  // Of the row that is being assigned, by column.
  std::vector<double> distance_;
  std::vector<Index> before_;  ///< column from which a column is reached
  std::vector<bool> done_;
};

}  // namespace trundle::slam
