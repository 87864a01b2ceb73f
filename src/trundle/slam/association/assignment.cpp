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
  if (!assign_by_regret(cost)) assign_by_augmentation(cost);
  return column_of_;
}

CheapestAssignment::Preference CheapestAssignment::preference_of(Index row, const Eigen::MatrixXd& cost) {
  Preference preference{kNone, kNone, 0.0};
  double least = kInfinity;
  double next = kInfinity;
  for (Index column = 0; column < cost.cols(); ++column) {
    const double x = cost(row, column);
    if (x < least) {
      preference.second = preference.best;
      preference.best = column;
      next = least;
      least = x;
    } else if (x < next) {
      preference.second = column;
      next = x;
    }
  }
  preference.regret = next - least;
  return preference;
}

/// Each row takes its cheapest column. Where several want the same one, it goes to the row that would lose
/// most without it, and the others take their second. As all but one have to do without it, no assignment
/// costs less. False where a second is taken as well: then augmenting paths are needed.
bool CheapestAssignment::assign_by_regret(const Eigen::MatrixXd& cost) {
  preferences_.clear();
  row_of_.assign(at(cost.cols()), kNone);
  for (Index row = 0; row < cost.rows(); ++row) {
    const Preference preference = preference_of(row, cost);
    preferences_.push_back(preference);
    Index& owner = row_of_[at(preference.best)];
    if (owner == kNone || preferences_[at(owner)].regret < preference.regret) owner = row;
  }
  column_of_.clear();
  for (Index row = 0; row < cost.rows(); ++row) {
    const Preference& preference = preferences_[at(row)];
    if (row_of_[at(preference.best)] == row) {
      column_of_.push_back(preference.best);
      continue;
    }
    if (row_of_[at(preference.second)] != kNone) return false;
    row_of_[at(preference.second)] = row;
    column_of_.push_back(preference.second);
  }
  return true;
}

/// Hungarian method [Kuhn 1955], O(rows² · columns): rows are assigned one after the other, each along the
/// shortest path of reduced costs.
void CheapestAssignment::assign_by_augmentation(const Eigen::MatrixXd& cost) {
  row_price_.assign(at(cost.rows()), 0.0);
  column_price_.assign(at(cost.cols()), 0.0);
  row_of_.assign(at(cost.cols()), kNone);
  for (Index row = 0; row < cost.rows(); ++row) assign(row, cost);
  column_of_.assign(at(cost.rows()), kNone);
  for (Index column = 0; column < cost.cols(); ++column)
    if (const Index row = row_of_[at(column)]; row != kNone) column_of_[at(row)] = column;
}

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
