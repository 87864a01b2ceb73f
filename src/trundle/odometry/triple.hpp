#pragma once

#include <array>

#include "trundle/namespaces.hpp"

namespace trundle::odometry {

/// (x, y, heading) of what is per step: a twist, a row of H, a column of a derivative. Arithmetic in the
/// kernels' order, so that one step and many have the same bits.
using Triple = std::array<double, 3>;

constexpr double dot(const Triple& a, const Triple& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// sum += factor · v
constexpr void add_scaled(Triple& sum, double factor, const Triple& v) {
  for (std::size_t i = 0; i < 3; ++i) sum[i] += factor * v[i];
}

}  // namespace trundle::odometry
