#pragma once

#include <array>

#include "trundle/geometry/pose2.hpp"

namespace trundle::odometry {

/// A symmetric 3×3 matrix: xx, xy, xh, yy, yh, hh.
using Symmetric3 = std::array<double, 6>;
Matrix3 full_matrix(const Symmetric3& s);
Symmetric3 symmetric_of(const Matrix3& matrix);

inline void add(Symmetric3& sum, const Symmetric3& more) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += more[i];
}

/// sum += factor · v vᵀ
inline void add_outer(Symmetric3& sum, double factor, const std::array<double, 3>& v) {
  const double x = factor * v[0];
  const double y = factor * v[1];
  sum[0] += x * v[0];
  sum[1] += x * v[1];
  sum[2] += x * v[2];
  sum[3] += y * v[1];
  sum[4] += y * v[2];
  sum[5] += factor * v[2] * v[2];
}

}  // namespace trundle::odometry
