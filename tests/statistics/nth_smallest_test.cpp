#include "trundle/statistics/nth_smallest.hpp"

#include <algorithm>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

namespace trundle::statistics {
namespace {

TEST(NthSmallest, IsWhatStandsThereInOrder) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Random random(3, 1);
  std::vector<double> values = {0.0,    -1.0,      1.0,        1e-310, -1e-310, 1e300,
                                -1e300, kInfinity, -kInfinity, 2.5,    2.5};
  for (int i = 0; i < 200; ++i)
    values.push_back(0.002 + 1e-12 * random.uniform() - (i % 3 == 0 ? 0.01 : 0.0));
  std::vector<double> sorted = values;
  std::ranges::sort(sorted);
  for (std::size_t n = 0; n < sorted.size(); ++n)
    EXPECT_EQ(nth_smallest(values.size(), n, [&](std::size_t i) { return values[i]; }), sorted[n]) << n;
}

TEST(NthSmallest, OfOneIsThatOne) {
  EXPECT_EQ(nth_smallest(1, 0, [](std::size_t) { return -3.0; }), -3.0);
}

}  // namespace
}  // namespace trundle::statistics
