#include "trundle/statistics/random.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace trundle::statistics {
namespace {

// Expected: the published generator and seeding written down a second time, in Python.
TEST(Random, GivesTheSameNumbersEverywhere) {
  Random random(1);
  EXPECT_EQ(random.bits(), 8089978747140965633ULL);
  EXPECT_EQ(random.bits(), 5687923198772495674ULL);
  EXPECT_NEAR(random.normal(), 1.092978543376238, 1e-14);
}

TEST(Random, StreamsOfOneSeedAreUnrelated) {
  Random a(7, 1);
  Random b(7, 2);
  double product = 0.0;
  constexpr int kDraws = 10000;
  for (int i = 0; i < kDraws; ++i) product += a.normal() * b.normal();
  EXPECT_LT(std::abs(product), 4.0 * std::sqrt(kDraws));  // sigma of the sum of products is √n
}

TEST(Random, CopyContinuesIndependently) {
  Random a(3);
  a.bits();
  Random b = a;
  EXPECT_EQ(a.bits(), b.bits());
  a.bits();
  EXPECT_NE(a.bits(), b.bits());
}

TEST(Random, UniformFillsItsIntervalEvenly) {
  Random random(11);
  constexpr int kDraws = 100000;
  std::vector<int> bins(20);
  for (int i = 0; i < kDraws; ++i) {
    const double u = random.uniform();
    ASSERT_GE(u, 0.0);
    ASSERT_LT(u, 1.0);
    ++bins[static_cast<std::size_t>(u * 20.0)];
  }
  double chi2 = 0.0;
  for (const int count : bins) chi2 += std::pow(count - kDraws / 20.0, 2) / (kDraws / 20.0);
  EXPECT_LT(chi2, 43.8);  // 99.9 % of χ² with 19 degrees of freedom
  EXPECT_GT(chi2, 5.4);   // 0.1 %
}

TEST(Random, BelowReachesEveryValueEvenly) {
  Random random(5);
  std::vector<int> counts(7);
  for (int i = 0; i < 70000; ++i) ++counts[random.below(7)];
  double chi2 = 0.0;
  for (const int count : counts) chi2 += std::pow(count - 10000.0, 2) / 10000.0;
  EXPECT_LT(chi2, 22.5);  // 99.9 % of χ² with 6 degrees of freedom
}

TEST(Random, NormalHasTheMomentsOfTheNormalDistribution) {
  Random random(13);
  constexpr int n = 200000;
  double m1 = 0.0, m2 = 0.0, m3 = 0.0, m4 = 0.0;
  for (int i = 0; i < n; ++i) {
    const double z = random.normal();
    m1 += z / n, m2 += z * z / n, m3 += z * z * z / n, m4 += z * z * z * z / n;
  }
  const double sigma =
      1.0 / std::sqrt(n);  // of a mean of unit variance; Var z² = 2, Var z³ = 15, Var z⁴ = 96
  EXPECT_NEAR(m1, 0.0, 4.0 * sigma);
  EXPECT_NEAR(m2, 1.0, 4.0 * std::sqrt(2.0) * sigma);
  EXPECT_NEAR(m3, 0.0, 4.0 * std::sqrt(15.0) * sigma);
  EXPECT_NEAR(m4, 3.0, 4.0 * std::sqrt(96.0) * sigma);
}

TEST(NormalQuantile, InvertsTheErrorFunction) {
  for (const double z : {-8.0, -6.5, -5.0, -3.0, -1.8, -1.0, -0.3, -1e-3, 0.0, 0.2, 1.2, 2.5}) {
    const double p = 0.5 * std::erfc(-z / std::sqrt(2.0));
    EXPECT_NEAR(normal_quantile(p), z, 2e-14 * (1.0 + std::abs(z))) << z;
  }
}

}  // namespace
}  // namespace trundle::statistics
