// Tails and quantiles against closed forms and printed tables.
#include "trundle/statistics/distribution.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trundle::statistics {
namespace {

TEST(Distribution, ChiSquaredWithTwoDegreesIsExponential) {
  for (const double x : {0.01, 1.0, 5.0, 30.0, 200.0})
    EXPECT_NEAR(chi_squared_tail(x, 2.0) / std::exp(-0.5 * x), 1.0, 1e-12) << x;
}

TEST(Distribution, ChiSquaredWithOneDegreeIsTheNormalTail) {
  for (const double z : {0.1, 1.0, 1.96, 4.0, 6.0})
    EXPECT_NEAR(chi_squared_tail(z * z, 1.0) / std::erfc(z / std::sqrt(2.0)), 1.0, 1e-12) << z;
}

TEST(Distribution, ChiSquaredWithFourDegrees) {
  for (const double x : {0.5, 3.0, 9.0, 40.0})
    EXPECT_NEAR(chi_squared_tail(x, 4.0) / (std::exp(-0.5 * x) * (1.0 + 0.5 * x)), 1.0, 1e-12) << x;
}

TEST(Distribution, StudentWithOneDegreeIsCauchyAndWithTwoIsAlgebraic) {
  for (const double tail : {0.5, 0.05, 1e-4}) {
    EXPECT_NEAR(student_t_limit(tail, 1.0) * std::tan(0.5 * std::acos(-1.0) * tail), 1.0, 1e-10);
    const double q = 1.0 - tail;
    EXPECT_NEAR(student_t_limit(tail, 2.0) / (q * std::sqrt(2.0 / (1.0 - q * q))), 1.0, 1e-10);
  }
}

TEST(Distribution, PrintedQuantiles) {
  EXPECT_NEAR(normal_limit(0.05), 1.959964, 5e-7);
  EXPECT_NEAR(normal_limit(1e-6), 4.891638, 5e-7);
  EXPECT_NEAR(student_t_limit(0.05, 10.0), 2.228139, 5e-7);
  EXPECT_NEAR(student_t_limit(0.01, 30.0), 2.749996, 5e-7);
  EXPECT_NEAR(chi_squared_limit(0.05, 2.0), kChiSquared2At95, 1e-9);
  EXPECT_NEAR(chi_squared_limit(0.05, 3.0), kChiSquared3At95, 1e-9);
  EXPECT_NEAR(normal_limit(0.05), kNormalAt95, 1e-9);
  EXPECT_NEAR(chi_squared_limit(0.01, 3.0), 11.344867, 5e-7);
  EXPECT_NEAR(chi_squared_limit(0.001, 10.0), 29.588298, 5e-7);
  EXPECT_NEAR(f_limit(0.05, 3.0, 20.0), 3.098391, 5e-7);
}

TEST(Distribution, FisherTendsToChiSquared) {
  EXPECT_NEAR(4.0 * f_limit(0.01, 4.0, 1e7) / chi_squared_limit(0.01, 4.0), 1.0, 1e-5);
}

}  // namespace
}  // namespace trundle::statistics
