#include "trundle/slam/association/assignment.hpp"

#include <algorithm>
#include <numeric>

#include <gtest/gtest.h>

#include "trundle/simulation/random.hpp"

namespace trundle {
namespace {

double cost_of(const Eigen::MatrixXd& cost, const std::vector<Eigen::Index>& columns) {
  double sum = 0.0;
  for (Eigen::Index row = 0; row < cost.rows(); ++row)
    sum += cost(row, columns[static_cast<std::size_t>(row)]);
  return sum;
}

/// Every order of all columns; the first `rows` of them are the assignment.
double least_by_trying_all(const Eigen::MatrixXd& cost) {
  std::vector<Eigen::Index> columns(static_cast<std::size_t>(cost.cols()));
  std::iota(columns.begin(), columns.end(), Eigen::Index{0});
  double least = 1e300;
  do {
    least = std::min(least, cost_of(cost, columns));
  } while (std::ranges::next_permutation(columns).found);
  return least;
}

TEST(Assignment, IsTheCheapestOfAll) {
  Random random(1);
  for (int run = 0; run < 300; ++run) {
    const auto rows = 1 + static_cast<Eigen::Index>(random.below(5));
    const auto columns = rows + static_cast<Eigen::Index>(random.below(3));
    Eigen::MatrixXd cost(rows, columns);
    for (Eigen::Index i = 0; i < cost.size(); ++i)
      cost(i) = run % 2 == 0 ? random.uniform(-3.0, 3.0) : static_cast<double>(random.below(4));
    const auto found = cheapest_assignment(cost);
    auto sorted = found;
    std::ranges::sort(sorted);
    ASSERT_EQ(std::ranges::adjacent_find(sorted), sorted.end());
    ASSERT_NEAR(cost_of(cost, found), least_by_trying_all(cost), 1e-12);
  }
}

TEST(Assignment, GreedyWouldFail) {
  const Eigen::MatrixXd cost = (Eigen::MatrixXd(2, 2) << 1.0, 2.0, 1.1, 100.0).finished();
  EXPECT_EQ(cheapest_assignment(cost), (std::vector<Eigen::Index>{1, 0}));
}

TEST(Assignment, OfNothing) {
  EXPECT_TRUE(cheapest_assignment(Eigen::MatrixXd(0, 0)).empty());
}

}  // namespace
}  // namespace trundle
