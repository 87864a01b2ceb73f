#include "trundle/slam/association/assignment.hpp"

#include <cassert>
#include <limits>

#include "trundle/slam/nth.hpp"

namespace trundle::slam {
namespace {

constexpr Eigen::Index kNone = -1;  // no row, or no column
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

const std::vector<Eigen::Index>& CheapestAssignment::solve(const Eigen::MatrixXd& cost) {
  assert(cost.cols() >= cost.rows() && cost.allFinite());
  row_price_.assign(nth(cost.rows()), 0.0);
  column_price_.assign(nth(cost.cols()), 0.0);
  row_of_.assign(nth(cost.cols()), kNone);
  for (Index row = 0; row < cost.rows(); ++row) assign(row, cost);
  column_of_.assign(nth(cost.rows()), kNone);
  for (Index column = 0; column < cost.cols(); ++column)
    if (const Index row = row_of_[nth(column)]; row != kNone) column_of_[nth(row)] = column;
  return column_of_;
}

/// Along the shortest path of reduced costs.
void CheapestAssignment::assign(Index first, const Eigen::MatrixXd& cost) {
  const std::size_t columns = nth(cost.cols());
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
      if (done_[nth(c)]) continue;
      const double step = reached + cost(row, c) - row_price_[nth(row)] - column_price_[nth(c)];
      if (step < distance_[nth(c)]) {
        distance_[nth(c)] = step;
        before_[nth(c)] = from;
      }
      if (column == kNone || distance_[nth(c)] < distance_[nth(column)]) column = c;
    }
    done_[nth(column)] = true;
    reached = distance_[nth(column)];
    row = row_of_[nth(column)];
  } while (row != kNone);
  raise_prices(first, reached);
  augment(first, column);
}

void CheapestAssignment::raise_prices(Index first, double reached) {
  row_price_[nth(first)] += reached;
  for (std::size_t c = 0; c < done_.size(); ++c) {
    if (!done_[c]) continue;
    column_price_[c] -= reached - distance_[c];
    if (const Index row = row_of_[c]; row != kNone) row_price_[nth(row)] += reached - distance_[c];
  }
}

void CheapestAssignment::augment(Index first, Index column) {
  while (before_[nth(column)] != kNone) {
    row_of_[nth(column)] = row_of_[nth(before_[nth(column)])];
    column = before_[nth(column)];
  }
  row_of_[nth(column)] = first;
}

}  // namespace trundle::slam
