#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/namespaces.hpp"

namespace trundle::slam {

/// Which column each row gets, no column twice, so that the sum of the costs is least. For many problems, one
/// after the other: those of one size need no new memory.
class CheapestAssignment {
 public:
  /// Column of each row, until the next call. At least as many columns as rows; finite costs.
  const std::vector<Eigen::Index>& solve(const Eigen::MatrixXd& cost);

 private:
  using Index = Eigen::Index;
  /// What a row would take.
  struct Wish {
    Index best, second;  ///< columns
    double loss;         ///< by taking the second
  };
  static Wish wish_of(Index row, const Eigen::MatrixXd& cost);
  bool give_way(const Eigen::MatrixXd& cost);
  void exchange_all(const Eigen::MatrixXd& cost);
  void assign(Index first, const Eigen::MatrixXd& cost);
  void raise_prices(Index first, double reached);
  void exchange(Index first, Index column);

  std::vector<Index> column_of_;  ///< by row
  std::vector<Index> row_of_;     ///< by column
  std::vector<Wish> wishes_;      ///< by row
  // Of the exchanges.
  std::vector<double> row_price_;
  std::vector<double> column_price_;
  // Of the row that is being assigned, by column.
  std::vector<double> distance_;
  std::vector<Index> before_;  ///< column from which a column is reached
  std::vector<bool> done_;
};

}  // namespace trundle::slam
