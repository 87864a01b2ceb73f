#include "trundle/slam/association/assignment.hpp"

#include <algorithm>
#include <functional>
#include <numeric>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::slam {
namespace {

using Columns = std::vector<Eigen::Index>;

double cost_of(const Eigen::MatrixXd& cost, const Columns& columns) {
  double sum = 0.0;
  for (Eigen::Index row = 0; row < cost.rows(); ++row)
    sum += cost(row, columns[static_cast<std::size_t>(row)]);
  return sum;
}

/// Every order of all columns; the first `rows` of them are the assignment.
double least_by_trying_all(const Eigen::MatrixXd& cost) {
  Columns columns(static_cast<std::size_t>(cost.cols()));
  std::iota(columns.begin(), columns.end(), Eigen::Index{0});
  double least = 1e300;
  do {
    least = std::min(least, cost_of(cost, columns));
  } while (std::ranges::next_permutation(columns).found);
  return least;
}

/// By one solver for all, of problems that change their size.
void expect_cheapest_of_all(const std::function<double(Random&)>& some_cost) {
  Random random(1);
  CheapestAssignment assignment;
  for (int run = 0; run < 300; ++run) {
    const auto rows = 1 + static_cast<Eigen::Index>(random.below(5));
    const auto columns = rows + static_cast<Eigen::Index>(random.below(3));
    Eigen::MatrixXd cost(rows, columns);
    for (Eigen::Index i = 0; i < cost.size(); ++i) cost(i) = some_cost(random);
    const Columns found = assignment.solve(cost);
    ASSERT_EQ(std::ssize(found), rows);
    Columns sorted = found;
    std::ranges::sort(sorted);
    ASSERT_EQ(std::ranges::adjacent_find(sorted), sorted.end());
    ASSERT_NEAR(cost_of(cost, found), least_by_trying_all(cost), 1e-12);
  }
}

TEST(CheapestAssignment, IsTheCheapestOfAll) {
  expect_cheapest_of_all([](Random& random) { return random.uniform(-3.0, 3.0); });
}

TEST(CheapestAssignment, IsTheCheapestOfAllWithTies) {
  expect_cheapest_of_all([](Random& random) { return static_cast<double>(random.below(4)); });
}

TEST(CheapestAssignment, GreedyWouldFail) {
  const Eigen::MatrixXd cost = (Eigen::Matrix2d() << 1.0, 2.0, 1.1, 100.0).finished();
  EXPECT_EQ(CheapestAssignment().solve(cost), (Columns{1, 0}));
}

TEST(CheapestAssignment, WhoGivesWayMayMakeAnotherGiveWay) {
  const Eigen::MatrixXd cost = (Eigen::Matrix3d() << 1.0, 9.0, 9.0, 1.0, 2.0, 9.0, 9.0, 1.0, 3.0).finished();
  EXPECT_EQ(CheapestAssignment().solve(cost), (Columns{0, 1, 2}));
}

TEST(CheapestAssignment, OfNothing) {
  EXPECT_TRUE(CheapestAssignment().solve(Eigen::MatrixXd(0, 0)).empty());
}

}  // namespace
}  // namespace trundle::slam
