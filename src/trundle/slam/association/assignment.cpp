#include "trundle/slam/association/assignment.hpp"

#include <cassert>
#include <limits>

namespace trundle {
namespace {

using Index = Eigen::Index;
constexpr Index kNone = -1;

/// Rows are assigned one after the other, each along the shortest path of exchanges in reduced costs.
class Hungarian {
 public:
  explicit Hungarian(const Eigen::MatrixXd& cost)
      : cost_(cost),
        row_price_(Eigen::VectorXd::Zero(cost.rows())),
        column_price_(Eigen::VectorXd::Zero(cost.cols())),
        row_of_(static_cast<std::size_t>(cost.cols()), kNone) {}

  std::vector<Index> solve() {
    for (Index row = 0; row < cost_.rows(); ++row) assign(row);
    std::vector<Index> column_of(static_cast<std::size_t>(cost_.rows()), kNone);
    for (Index column = 0; column < cost_.cols(); ++column)
      if (const Index row = row_of_[at(column)]; row != kNone) column_of[at(row)] = column;
    return column_of;
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  void assign(Index first) {
    const auto columns = at(cost_.cols());
    distance_.assign(columns, std::numeric_limits<double>::infinity());
    before_.assign(columns, kNone);
    done_.assign(columns, false);
    Index row = first;
    Index column = kNone;
    double reached = 0.0;
    do {
      const Index from = column;
      column = kNone;
      for (Index c = 0; c < cost_.cols(); ++c) {
        if (done_[at(c)]) continue;
        const double step = reached + cost_(row, c) - row_price_[row] - column_price_[c];
        if (step < distance_[at(c)]) {
          distance_[at(c)] = step;
          before_[at(c)] = from;
        }
        if (column == kNone || distance_[at(c)] < distance_[at(column)]) column = c;
      }
      done_[at(column)] = true;
      reached = distance_[at(column)];
      row = row_of_[at(column)];
    } while (row != kNone);
    raise_prices(first, reached);
    exchange(first, column);
  }

  void raise_prices(Index first, double reached) {
    row_price_[first] += reached;
    for (Index c = 0; c < cost_.cols(); ++c) {
      if (!done_[at(c)]) continue;
      column_price_[c] -= reached - distance_[at(c)];
      if (const Index row = row_of_[at(c)]; row != kNone) row_price_[row] += reached - distance_[at(c)];
    }
  }

  void exchange(Index first, Index column) {
    while (before_[at(column)] != kNone) {
      row_of_[at(column)] = row_of_[at(before_[at(column)])];
      column = before_[at(column)];
    }
    row_of_[at(column)] = first;
  }

  const Eigen::MatrixXd& cost_;
  Eigen::VectorXd row_price_;
  Eigen::VectorXd column_price_;
  std::vector<Index> row_of_;  ///< by column
  // Of the row that is being assigned, by column.
  std::vector<double> distance_;
  std::vector<Index> before_;  ///< column from which a column is reached
  std::vector<bool> done_;
};

}  // namespace

std::vector<Eigen::Index> cheapest_assignment(const Eigen::MatrixXd& cost) {
  assert(cost.cols() >= cost.rows() && cost.allFinite());
  return Hungarian(cost).solve();
}

}  // namespace trundle
