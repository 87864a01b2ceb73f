#include "trundle/slam/association/assignment.hpp"

#include <cassert>
#include <limits>

namespace trundle::slam {
namespace {

constexpr Eigen::Index kNone = -1;  // no row, or no column
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t at(Eigen::Index i) {
  return static_cast<std::size_t>(i);
}

}  // namespace

const std::vector<Eigen::Index>& CheapestAssignment::solve(const Eigen::MatrixXd& cost) {
  assert(cost.cols() >= cost.rows() && cost.allFinite());
  row_price_.assign(at(cost.rows()), 0.0);
  column_price_.assign(at(cost.cols()), 0.0);
  row_of_.assign(at(cost.cols()), kNone);
  for (Index row = 0; row < cost.rows(); ++row) assign(row, cost);
  column_of_.assign(at(cost.rows()), kNone);
  for (Index column = 0; column < cost.cols(); ++column)
    if (const Index row = row_of_[at(column)]; row != kNone) column_of_[at(row)] = column;
  return column_of_;
}

/// Along the shortest path of reduced costs.
void CheapestAssignment::assign(Index first, const Eigen::MatrixXd& cost) {
  const std::size_t columns = at(cost.cols());
  distance_.assign(columns, kInfinity);
  before_.assign(columns, kNone);
  done_.assign(columns, false);
  Index row = first;
  Index column = kNone;
  double reached = 0.0;
  do {
    const Index from = column;
    column = kNone;
    for (Index c = 0; c < cost.cols(); ++c) {
      if (done_[at(c)]) continue;
      const double step = reached + cost(row, c) - row_price_[at(row)] - column_price_[at(c)];
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
  augment(first, column);
}

void CheapestAssignment::raise_prices(Index first, double reached) {
  row_price_[at(first)] += reached;
  for (std::size_t c = 0; c < done_.size(); ++c) {
    if (!done_[c]) continue;
    column_price_[c] -= reached - distance_[c];
    if (const Index row = row_of_[c]; row != kNone) row_price_[at(row)] += reached - distance_[c];
  }
}

void CheapestAssignment::augment(Index first, Index column) {
  while (before_[at(column)] != kNone) {
    row_of_[at(column)] = row_of_[at(before_[at(column)])];
    column = before_[at(column)];
  }
  row_of_[at(column)] = first;
}

}  // namespace trundle::slam
