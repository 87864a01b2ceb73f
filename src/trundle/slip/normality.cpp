#include "trundle/slip/normality.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/geometry/squared.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::slip {
namespace {

/// The moments of values with counts, in two passes: the mean first.
template <typename Values, typename ValueOf, typename CountOf>
Moments moments_of(const Values& values, ValueOf value_of, CountOf count_of) {
  double n = 0.0;
  double sum = 0.0;
  for (const auto& v : values) {
    n += count_of(v);
    sum += count_of(v) * value_of(v);
  }
  if (n == 0.0) return {};
  Moments moments{.count = static_cast<std::size_t>(n), .mean = sum / n, .kurtosis = 3.0};
  double b3 = 0.0;
  double b4 = 0.0;
  for (const auto& v : values) {
    const double d = value_of(v) - moments.mean;
    moments.variance += count_of(v) * d * d / n;
    b3 += count_of(v) * d * d * d / n;
    b4 += count_of(v) * d * d * d * d / n;
  }
  if (moments.variance <= 0.0) return moments;
  moments.skewness = b3 / std::pow(moments.variance, 1.5);
  moments.kurtosis = b4 / squared(moments.variance);
  return moments;
}

}  // namespace

Moments moments_of(std::span<const double> sample) {
  return moments_of(
      sample, [](double x) { return x; }, [](double) { return 1.0; });
}

Moments moments_of(std::span<const Bin> bins) {
  return moments_of(
      bins, [](const Bin& b) { return b.centre; }, [](const Bin& b) { return static_cast<double>(b.count); });
}

NormalityTest test_normality(const Moments& moments, double significance) {
  NormalityTest test{.moments = moments, .limit = normal_limit(0.5 * significance)};
  if (moments.count < kLeastNormalitySample || moments.variance <= 0.0) return test;
  const auto n = static_cast<double>(moments.count);
  test.sigma_skewness = std::sqrt(6.0 * (n - 2.0) / ((n + 1.0) * (n + 3.0)));
  test.sigma_kurtosis =
      std::sqrt(24.0 * n * (n - 2.0) * (n - 3.0) / (squared(n + 1.0) * (n + 3.0) * (n + 5.0)));
  test.expected_kurtosis = 3.0 - 6.0 / (n + 1.0);
  test.u1 = moments.skewness / test.sigma_skewness;
  test.u2 = (moments.kurtosis - test.expected_kurtosis) / test.sigma_kurtosis;
  test.rejected = std::abs(test.u1) >= test.limit || std::abs(test.u2) >= test.limit;
  return test;
}

std::vector<Bin> histogram_of(std::span<const double> sample, std::size_t bins) {
  if (sample.empty() || bins == 0) return {};
  const auto [low, high] = std::ranges::minmax(sample);
  const double width = (high - low) / static_cast<double>(bins);
  if (!(width > 0.0)) return {{low, sample.size()}};
  std::vector<Bin> histogram(bins);
  for (std::size_t i = 0; i < bins; ++i) histogram[i].centre = low + (static_cast<double>(i) + 0.5) * width;
  for (const double x : sample)
    ++histogram[std::min(bins - 1, static_cast<std::size_t>((x - low) / width))].count;
  return histogram;
}

std::vector<QuantilePair> quantile_pairs(std::span<const double> sample, std::size_t most) {
  std::vector<double> sorted(sample.begin(), sample.end());
  std::ranges::sort(sorted);
  const std::size_t count = std::min(most, sorted.size());
  std::vector<QuantilePair> pairs;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = k * sorted.size() / count;
    const double p = (static_cast<double>(i) + 0.5) / static_cast<double>(sorted.size());
    pairs.push_back({normal_quantile(p), sorted[i]});
  }
  return pairs;
}

}  // namespace trundle::slip
