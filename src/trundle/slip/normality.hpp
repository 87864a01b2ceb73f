#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::slip {

/// Central moments of a sample: docs/theory/slip-published.md, eq. 2.
struct Moments {
  std::size_t count = 0;
  double mean = 0.0;
  double variance = 0.0;  ///< B2, divided by n
  double skewness = 0.0;  ///< G1 = B3 / B2^1.5; 0 for a sample without spread
  double kurtosis = 0.0;  ///< G2 = B4 / B2²; 3 for a sample without spread
};
Moments moments_of(std::span<const double> sample);

/// A column of a histogram, as if all its values stood at its centre.
struct Bin {
  double centre = 0.0;
  std::size_t count = 0;
};
Moments moments_of(std::span<const Bin> bins);

/// Is a sample normal? By its skewness and kurtosis: docs/theory/slip-published.md, eq. 3. [source 2;
/// D'Agostino & Pearson]
struct NormalityTest {
  Moments moments;
  double sigma_skewness = 0.0;     ///< σ1
  double sigma_kurtosis = 0.0;     ///< σ2
  double expected_kurtosis = 0.0;  ///< μ2
  double u1 = 0.0;                 ///< standardised skewness
  double u2 = 0.0;                 ///< standardised kurtosis
  double limit = 0.0;              ///< z beyond which |u1| or |u2| rejects
  bool rejected = true;
};
/// With fewer values skewness and kurtosis are far from normal themselves, whatever they are of.
inline constexpr std::size_t kLeastNormalitySample = 8;
/// A sample of fewer values, or without spread, is never taken for normal.
NormalityTest test_normality(const Moments& moments, double significance = 0.1);

/// `bins` columns of equal width from the smallest value to the largest.
std::vector<Bin> histogram_of(std::span<const double> sample, std::size_t bins);

/// A point of the normal quantile–quantile plot: on a line where the sample is normal.
struct QuantilePair {
  double normal = 0.0;  ///< of N(0, 1) at (i − ½)/n
  double sample = 0.0;
};
/// At most `most` of them, evenly over the ranks.
std::vector<QuantilePair> quantile_pairs(std::span<const double> sample, std::size_t most = 200);

}  // namespace trundle::slip
