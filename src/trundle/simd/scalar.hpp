#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "trundle/simd/coefficients.hpp"

/// The elementary functions of one double, with the bits that kernels give in every lane.
namespace trundle::simd::scalar {

// What elementary.inl is written in; lanes.inl has the same for vectors.

template <class V>
using LaneOf = V;
template <class V>
using IntegersOf = std::uint64_t;

template <class V, class X>
TRUNDLE_INLINE constexpr V each(X x) {
  return static_cast<V>(x);
}
TRUNDLE_INLINE double abs(double x) {
  return std::abs(x);
}
TRUNDLE_INLINE double min(double a, double b) {
  return a < b ? a : b;
}
TRUNDLE_INLINE double max(double a, double b) {
  return a > b ? a : b;
}
TRUNDLE_INLINE double with_sign_of(double sign, double magnitude) {
  return std::copysign(magnitude, sign);
}
TRUNDLE_INLINE double select(bool mask, double yes, double no) {
  return mask ? yes : no;
}
TRUNDLE_INLINE double or_zero(bool mask, double yes) {
  return mask ? yes : 0.0;
}
TRUNDLE_INLINE bool both(bool a, bool b) {
  return a && b;
}
/// One number takes the way that serves all: a branch costs it more than it saves.
template <class V>
TRUNDLE_INLINE constexpr bool can_leave_out(bool) {
  return false;
}
TRUNDLE_INLINE std::uint64_t bits_of(double x) {
  return std::bit_cast<std::uint64_t>(x);
}
template <class V>
TRUNDLE_INLINE V number_of(std::uint64_t bits) {
  return std::bit_cast<V>(bits);
}
template <class V>
TRUNDLE_INLINE V converted(std::uint64_t integer) {
  return static_cast<V>(static_cast<std::int64_t>(integer));
}
/// A mask that chooses without a branch: quadrants follow no pattern.
template <class V>
TRUNDLE_INLINE std::uint64_t has_bit(std::uint64_t bits, std::uint64_t bit) {
  return bits & bit ? ~std::uint64_t{0} : 0;
}
TRUNDLE_INLINE double select(std::uint64_t mask, double yes, double no) {
  return number_of<double>((bits_of(yes) & mask) | (bits_of(no) & ~mask));
}
template <int kBits>
TRUNDLE_INLINE std::uint64_t shift_left(std::uint64_t bits) {
  return bits << kBits;
}
template <int kBits>
TRUNDLE_INLINE std::uint64_t shift_right(std::uint64_t bits) {
  return static_cast<std::uint64_t>(static_cast<std::int64_t>(bits) >> kBits);
}
TRUNDLE_INLINE double flip(double x, std::uint64_t bits) {
  return number_of<double>(bits_of(x) ^ bits);
}

#include "trundle/simd/elementary.inl"

}  // namespace trundle::simd::scalar
