#pragma once

#include <vector>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

/// Of an even number of values the upper of the two in the middle; NaN of none.
double median(std::vector<double> values);

/// From the median of |x| to the σ of a Gaussian: 1 / Φ⁻¹(3/4).
inline constexpr double kSigmaOfMedian = 1.4826;

}  // namespace trundle::statistics
