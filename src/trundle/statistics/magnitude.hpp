#pragma once

#include <algorithm>
#include <cmath>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

/// Of x, known to 1σ: |x| without what noise alone adds to it, √(x² − σ²), and 0 where that is all of it.
inline double magnitude(double x, double sigma) {
  return std::sqrt(std::max(0.0, x * x - sigma * sigma));
}

}  // namespace trundle::statistics
