#pragma once

#include <array>
#include <cstddef>

#include "trundle/odometry/symmetric3.hpp"
#include "trundle/odometry/triple.hpp"
#include "trundle/odometry/twist_step.hpp"
#include "trundle/simd/scalar.hpp"

namespace trundle::odometry {

/// What the normal equations of an interval with steered wheels are summed up from: N ξ = Hᵀ W z, the rows of
/// a wheel weighed by `rolling` (0 without an encoder) and `lateral`. docs/theory/odometry.md, eq. 11.
struct SteeredSums {
  struct Wheel {
    std::size_t index;  ///< in Increment::turned and steering_rad
    double x_m, y_m;
    double direction_rad, scale, zero_rad;
    double metres;  ///< in a revolution
    double rolling, lateral;
  };
  std::array<Wheel, kMaxWheels> wheel{};
  std::size_t wheel_count = 0;

  struct Input {
    std::size_t column;  ///< wheel, or kMaxWheels: the gyro's integral, or that + 1: the duration
    Triple by_input;     ///< column of Hᵀ W Z
  };
  std::array<Input, kMaxInputs> input{};  ///< of all other rows
  std::size_t input_count = 0;
  Symmetric3 normal{};  ///< their N
};

/// Determinants of N below this share of what they would be for rows that are orthogonal are looked at by
/// rank: rows_at().
inline constexpr double kSmallestDeterminant = 1e-9;

/// The twist; `seen` is positive where the rows plainly see all of it.
template <class V>
struct SteeredTwist {
  V dx, dy, dtheta;
  V seen;
};

namespace one_number {
using namespace simd::scalar;
#include "trundle/odometry/steered_twist.inl"
}  // namespace one_number

}  // namespace trundle::odometry
