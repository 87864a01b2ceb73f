#pragma once

#include <cmath>

#include "trundle/geometry/pose2.hpp"

namespace trundle::slam {

/// Lower L with L Lᵀ = covariance, which may be singular: a direction without variance gets no column.
[[nodiscard]] inline Matrix3 semidefinite_root(const Matrix3& covariance) {
  Matrix3 L = Matrix3::Zero();
  for (int j = 0; j < 3; ++j) {
    const double pivot = covariance(j, j) - L.row(j).squaredNorm();
    if (pivot <= 1e-14 * covariance(j, j)) continue;
    L(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < 3; ++i) L(i, j) = (covariance(i, j) - L.row(i).dot(L.row(j))) / L(j, j);
  }
  return L;
}

}  // namespace trundle::slam
