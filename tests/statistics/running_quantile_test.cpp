#include "trundle/statistics/running_quantile.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace trundle::statistics {
namespace {

TEST(RunningQuantile, SettlesAtItsShare) {
  for (const double share_above : {0.5, 0.02}) {
    std::mt19937 random(7);
    std::lognormal_distribution<double> speed(0.0, 0.5);
    RunningQuantile quantile(share_above);
    int above = 0;
    constexpr int kValues = 200'000;
    for (int i = 0; i < kValues; ++i) {
      const double value = speed(random);
      above += value > quantile.level() ? 1 : 0;
      quantile.add(value);
    }
    // Over a long time its ups and downs balance, whatever the distribution: each value above raises it by
    // gain (1 − share), each below lowers it by gain · share.
    EXPECT_NEAR(static_cast<double>(above) / kValues, share_above, 0.1 * share_above + 0.01);
  }
}

TEST(RunningQuantile, StaysWithWhatIsConstant) {
  RunningQuantile quantile(0.5);
  for (int i = 0; i < 1000; ++i) {
    quantile.add(0.02);
    EXPECT_NEAR(quantile.level(), 0.02, 0.5 * 0.02);
  }
  EXPECT_NEAR(quantile.level(), 0.02, 0.05 * 0.02);
}

TEST(RunningQuantile, ForgetsAFirstValueThatWasNoneOfThem) {
  RunningQuantile quantile(0.5);
  quantile.add(10.0);
  for (int i = 0; i < 300; ++i) quantile.add(0.02);
  EXPECT_NEAR(quantile.level(), 0.02, 0.1 * 0.02);
}

}  // namespace
}  // namespace trundle::statistics
