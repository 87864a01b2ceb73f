// The normality test and the bands, against the figures of source 2 and against samples whose law is known.
#include "trundle/slip/normality.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/slip/band.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "scale.hpp"

namespace trundle::slip {
namespace {

/// Table 1 of the source: δ in clean straight driving.
std::vector<Bin> table_1() {
  constexpr std::array<std::size_t, 10> kCounts = {9, 21, 92, 163, 232, 218, 151, 74, 30, 10};
  std::vector<Bin> bins;
  for (std::size_t i = 0; i < kCounts.size(); ++i)
    bins.push_back({-4.5 + static_cast<double>(i), kCounts[i]});
  return bins;
}

TEST(Normality, TableOneOfTheSource) {
  const NormalityTest test = test_normality(moments_of(table_1()), 0.1);
  EXPECT_EQ(test.moments.count, 1000U);
  EXPECT_NEAR(test.moments.mean, -0.034, 1e-12);
  EXPECT_NEAR(test.moments.variance, 2.864844, 5e-7);
  EXPECT_NEAR(test.moments.skewness, 0.0919270, 5e-8);
  EXPECT_NEAR(test.moments.kurtosis, 2.8739246, 5e-8);
  EXPECT_NEAR(test.u1, 1.19034, 5e-6);
  EXPECT_NEAR(test.u2, -0.78095, 5e-6);
  EXPECT_NEAR(test.limit, 1.96, 5e-5);
  EXPECT_FALSE(test.rejected);
}

TEST(Normality, TheSourcesBand) {
  const Band band = known_band(moments_of(table_1()), 1.96);
  EXPECT_NEAR(band.lower, -3.35147, 5e-6);
  EXPECT_NEAR(band.upper, 3.28347, 5e-6);
  EXPECT_NEAR(band.probability, 0.05, 5e-6);
}

TEST(Normality, AcceptsNormalSamplesAsOftenAsItPromises) {
  Random random(1);
  const int repeats = test::trials(2000);
  int rejected = 0;
  std::vector<double> sample(400);
  for (int i = 0; i < repeats; ++i) {
    for (double& x : sample) x = 3.0 + 0.2 * random.normal();
    rejected += test_normality(moments_of(sample), 0.1).rejected ? 1 : 0;
  }
  // Two tests of a/2 each; the kurtosis of 400 values is not quite normal itself: 0.07 to 0.12 are in order.
  const double share = static_cast<double>(rejected) / repeats;
  const double spread = 3.3 * std::sqrt(0.1 * 0.9 / repeats);
  EXPECT_GT(share, 0.07 - spread);
  EXPECT_LT(share, 0.12 + spread);
}

TEST(Normality, RejectsWhatIsNot) {
  Random random(2);
  std::vector<double> uniform(500);
  std::vector<double> skewed(500);
  std::vector<double> heavy(500);
  for (double& x : uniform) x = random.uniform();
  for (double& x : skewed) x = -std::log(1.0 - random.uniform());
  for (double& x : heavy) x = random.normal() / std::max(0.05, random.uniform());
  EXPECT_TRUE(test_normality(moments_of(uniform)).rejected);
  EXPECT_TRUE(test_normality(moments_of(skewed)).rejected);
  EXPECT_TRUE(test_normality(moments_of(heavy)).rejected);
}

TEST(Normality, NeverTakesAConstantOrAHandfulForNormal) {
  EXPECT_TRUE(test_normality(moments_of(std::vector<double>(100, 1.5))).rejected);
  EXPECT_TRUE(test_normality(moments_of(std::vector<double>{1.0, 2.0, 3.0})).rejected);
  EXPECT_TRUE(test_normality(moments_of(std::span<const double>{})).rejected);
  EXPECT_TRUE(std::isfinite(test_normality(moments_of(std::vector<double>(9, 0.0))).u2));
}

TEST(Normality, HistogramAndQuantilesShowTheSample) {
  Random random(3);
  std::vector<double> sample(1000);
  for (double& x : sample) x = 1.0 + 2.0 * random.normal();
  std::size_t total = 0;
  for (const Bin& bin : histogram_of(sample, 20)) total += bin.count;
  EXPECT_EQ(total, sample.size());
  const auto pairs = quantile_pairs(sample, 100);
  ASSERT_EQ(pairs.size(), 100U);
  for (std::size_t i = 10; i < 90; ++i) EXPECT_NEAR(pairs[i].sample, 1.0 + 2.0 * pairs[i].normal, 0.5);
}

TEST(Band, NormalSampleGivesStudentsInterval) {
  Random random(4);
  std::vector<double> sample(50);
  for (double& x : sample) x = random.normal();
  const Moments m = moments_of(sample);
  const Band band = learn_band(sample, 0.05);
  ASSERT_FALSE(band.normality.rejected);
  const double half = student_t_limit(0.05, 49.0) * std::sqrt(m.variance * 50.0 / 49.0 * (1.0 + 1.0 / 50.0));
  EXPECT_NEAR(band.upper, m.mean + half, 1e-12);
  EXPECT_NEAR(band.lower, m.mean - half, 1e-12);
}

TEST(Band, ASampleThatIsNotNormalGivesItsQuantiles) {
  Random random(5);
  std::vector<double> sample(999);
  for (double& x : sample) x = -std::log(1.0 - random.uniform());
  const Band band = learn_band(sample, 0.02);
  EXPECT_TRUE(band.empirical);
  EXPECT_FALSE(band.beyond_sample);
  EXPECT_NEAR(band.lower, 0.01, 0.01);
  EXPECT_NEAR(band.upper, -std::log(0.01), 1.0);
  EXPECT_EQ(std::ranges::count_if(sample, [&](double x) { return x > band.upper; }), 9);
  EXPECT_TRUE(learn_band(sample, 1e-6).beyond_sample);
}

TEST(Band, KnowsWhereItWasLearned) {
  Band band;
  band.interval_s = 0.25;
  band.least_speed_m_s = 0.24;
  band.greatest_speed_m_s = 0.26;
  EXPECT_TRUE(band.holds_for(0.25, 0.25));
  EXPECT_TRUE(band.holds_for(0.25, -0.25));
  EXPECT_FALSE(band.holds_for(0.5, 0.25));
  EXPECT_FALSE(band.holds_for(0.25, 0.5));
  EXPECT_FALSE(band.holds_for(0.25, 0.1));
}

TEST(Band, RefusesTooFewOrConstantSamples) {
  EXPECT_THROW(learn_band(std::vector<double>{1.0, 2.0}, 0.05), CannotAnswer);
  EXPECT_THROW(learn_band(std::vector<double>(100, 1.0), 0.05), CannotAnswer);
}

}  // namespace
}  // namespace trundle::slip
