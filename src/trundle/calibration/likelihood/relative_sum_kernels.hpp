#pragma once

#include <array>

#include "trundle/calibration/likelihood/relative_kernel.hpp"

namespace trundle::calibration {

inline constexpr std::size_t kMaxInputPairs = kMaxInputs * (kMaxInputs + 1) / 2;

/// A sum over every eighth increment in each of its columns: the same bits however many are added at once.
inline constexpr std::size_t kRelativeLanes = 8;
using RelativeSum = std::array<double, kRelativeLanes>;

/// What is summed. A chassis parameter's Jacobian is A T_j u, so moments of the inputs u with AᵀΩA, AᵀΩS and
/// AᵀΩr are enough, whatever the T_j are; A = ∂predicted/∂ξ, S = ∂predicted/∂ℓ.
struct alignas(64) RelativeSums {
  std::array<std::array<RelativeSum, 6>, kMaxInputPairs> chassis;  ///< u_a u_b AᵀΩA (a <= b), symmetric
  std::array<std::array<RelativeSum, 9>, kMaxInputs> crossed;      ///< u_a AᵀΩS, by rows
  std::array<RelativeSum, 6> sensor;                               ///< SᵀΩS, symmetric
  std::array<std::array<RelativeSum, 3>, kMaxInputs> chassis_gradient;
  std::array<RelativeSum, 3> sensor_gradient;
  RelativeSum cost;
  RelativeSum outliers;
};

/// Everything that is the same for all increments. Vectors are in body axes: the residual turned by ℓ's
/// heading.
struct RelativeConstants {
  const double* T;
  std::size_t inputs;
  double lever_x, lever_y;
  double cos_mount, sin_mount;
  std::array<double, 6> omega;  ///< Ω in body axes: xx, xy, xh, yy, yh, hh
  double gate;
};

/// Adds all increments.
void sum_relative(const RelativeColumns& columns, const RelativeConstants& constants, RelativeSums& sums);

}  // namespace trundle::calibration
