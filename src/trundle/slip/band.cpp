#include "trundle/slip/band.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::slip {
namespace {

// How far interval and speed may be from those that the band was learned at, as shares of these:
// docs/theory/slip-published.md, below eq. 4.
constexpr double kSameInterval = 0.1;
constexpr double kSameSpeed = 0.25;  // noise that grows with the way is then off by an eighth

void use_quantiles(std::span<const double> sample, double probability, Band& band) {
  std::vector<double> sorted(sample.begin(), sample.end());
  std::ranges::sort(sorted);
  band.empirical = true;
  band.upper = upper_quantile(sorted, 0.5 * probability, band.beyond_sample);
  for (double& x : sorted) x = -x;
  std::ranges::reverse(sorted);
  band.lower = -upper_quantile(sorted, 0.5 * probability, band.beyond_sample);
}

}  // namespace

bool Band::holds_for(double duration_s, double speed_m_s) const {
  const double speed = std::abs(speed_m_s);
  return std::abs(duration_s - interval_s) <= kSameInterval * interval_s &&
         speed >= least_speed_m_s * (1.0 - kSameSpeed) && speed <= greatest_speed_m_s * (1.0 + kSameSpeed);
}

Band known_band(const Moments& moments, double z) {
  const double half = z * std::sqrt(moments.variance);
  Band band;
  band.lower = moments.mean - half;
  band.upper = moments.mean + half;
  band.probability = std::erfc(z / std::sqrt(2.0));
  return band;
}

Band learn_band(std::span<const double> sample, double probability, double significance) {
  const Moments moments = moments_of(sample);
  if (moments.count < kLeastNormalitySample || moments.variance <= 0.0)
    throw CannotAnswer(fmt::format(
        "only {} intervals of clean straight driving to learn from, at least {} with some spread are "
        "needed",
        moments.count, kLeastNormalitySample));
  const auto n = static_cast<double>(moments.count);
  const double half =
      student_t_limit(probability, n - 1.0) * std::sqrt(moments.variance * n / (n - 1.0) * (1.0 + 1.0 / n));
  Band band;
  band.lower = moments.mean - half;
  band.upper = moments.mean + half;
  band.probability = probability;
  band.normality = test_normality(moments, significance);
  if (band.normality.rejected) use_quantiles(sample, probability, band);
  return band;
}

double upper_quantile(std::span<const double> sorted, double p, bool& beyond_sample) {
  // The next value exceeds the k-th of n with probability 1 − k/(n + 1), whatever the distribution.
  const auto n = static_cast<double>(sorted.size());
  const double rank = std::ceil((n + 1.0) * (1.0 - p) - 1e-9);
  if (rank <= n) return sorted[static_cast<std::size_t>(std::max(1.0, rank)) - 1];
  beyond_sample = true;
  return sorted.back();
}

}  // namespace trundle::slip
