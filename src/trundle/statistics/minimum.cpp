#include "trundle/statistics/minimum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/math/tools/minima.hpp>

namespace trundle::statistics {

double minimum_within(const Bracket& bracket, const std::function<double(double)>& function) {
  const double size = std::max({std::abs(bracket.low), std::abs(bracket.high), bracket.tolerance});
  const double bits = 1.0 + std::ceil(std::log2(size / bracket.tolerance));
  const int most = std::numeric_limits<double>::digits / 2;  // near a minimum a function tells no more
  return boost::math::tools::brent_find_minima(function, bracket.low, bracket.high,
                                               std::min(static_cast<int>(bits), most))
      .first;
}

}  // namespace trundle::statistics
