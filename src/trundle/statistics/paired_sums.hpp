#pragma once

#include <algorithm>
#include <cmath>

#include "trundle/namespaces.hpp"

namespace trundle::statistics {

/// Sums of squares and products of pairs (x, y) whose means are zero.
struct PairedSums {
  double xx = 0.0, yy = 0.0, xy = 0.0;

  void add(double x, double y) {
    xx += x * x;
    yy += y * y;
    xy += x * y;
  }
  /// y for one of x.
  double slope() const { return xy / xx; }
  double correlation() const { return xy / std::sqrt(xx * yy); }
  /// The same with y turned round, where it goes against x.
  PairedSums in_one_sense() const { return {xx, yy, std::abs(xy)}; }
  /// How much there is of the one of which there is less: root of its sum of squares.
  double lesser() const { return std::sqrt(std::min(xx, yy)); }
};

}  // namespace trundle::statistics
