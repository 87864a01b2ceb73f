#include "trundle/statistics/minimum.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trundle::statistics {
namespace {

TEST(Minimum, IsFoundToItsTolerance) {
  for (const double tolerance : {1e-1, 1e-3, 1e-5})
    for (const double at : {-3.7, 0.0, 1e-3, 2.5}) {
      const auto bowl = [=](double x) { return std::cosh(x - at); };
      EXPECT_NEAR(minimum_within({at - 0.7, at + 1.9, tolerance}, bowl), at, tolerance) << at;
    }
}

TEST(Minimum, MayLieAtTheEdge) {
  EXPECT_NEAR(minimum_within({1.0, 3.0, 1e-4}, [](double x) { return x; }), 1.0, 1e-3);
}

TEST(Minimum, NeedsFewEvaluations) {
  int calls = 0;
  minimum_within({-1.0, 2.0, 1e-5}, [&](double x) {
    ++calls;
    return (x - 0.3) * (x - 0.3);
  });
  EXPECT_LT(calls, 20);  // a golden section takes 25
}

}  // namespace
}  // namespace trundle::statistics
