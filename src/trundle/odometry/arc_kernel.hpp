#pragma once

#include "trundle/odometry/lanes.hpp"
#include "trundle/simd/coefficients.hpp"

// Everything here is inlined: how lanes are passed between functions does not matter.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace trundle {

// The arithmetic of one arc, for Real = double or Lanes, without branches. Ranges are the caller's duty.

template <class Real>
struct SinCos {
  Real sin;
  Real cos;
};

/// cos r of z = r², |r| <= π/4.
template <class Real>
TRUNDLE_INLINE Real cos_polynomial(const Real& z) {
  return 1.0 - (0.5 * z - z * z *
                              (0x1.5555555555555p-5 +
                               z * (-0x1.6c16c16c16960p-10 +
                                    z * (0x1.a01a019f4d0edp-16 +
                                         z * (-0x1.27e4fa15bd814p-22 +
                                              z * (0x1.1eeb66b683027p-29 - z * 0x1.907c0e63adb5ep-37))))));
}

/// sin x and cos x together, each within 1.5e-16, |x| <= kLargestAngle. x = q π/2 + r with π/2 in three parts
/// of 33 bits, whose products with q are exact; polynomials in r² fitted at Chebyshev nodes over |r| <= π/4.
template <class Real>
TRUNDLE_INLINE SinCos<Real> sin_cos(const Real& x) {
  constexpr double kRound = 0x1.8p52;  // adding it rounds to an integer, which stands in the low bits
  const Real shifted = x * 0x1.45f306dc9c883p-1 + kRound;
  const Real q = shifted - kRound;
  const Real r = ((x - q * 0x1.921fb544p+0) - q * 0x1.0b4611a6p-34) - q * 0x1.3198a2ep-69;
  const Real z = r * r;
  const Real sin_r =
      r +
      r * z *
          (-0x1.5555555555555p-3 +
           z * (0x1.1111111110ba5p-7 + z * (-0x1.a01a019e80693p-13 +
                                            z * (0x1.71de379252004p-19 +
                                                 z * (-0x1.ae60069e53ef0p-26 + z * 0x1.5e098556d2fd6p-33)))));
  const Real cos_r = cos_polynomial(z);
  using Bits = BitsOf<Real>;
  const Bits quadrant = __builtin_bit_cast(Bits, shifted);
  const Bits odd = -(quadrant & 1U);  // all ones where sin and cos change places
  const Bits sin_bits = __builtin_bit_cast(Bits, sin_r);
  const Bits cos_bits = __builtin_bit_cast(Bits, cos_r);
  const Bits exchange = (sin_bits ^ cos_bits) & odd;
  return {__builtin_bit_cast(Real, (sin_bits ^ exchange) ^ ((quadrant & 2U) << 62U)),
          __builtin_bit_cast(Real, (cos_bits ^ exchange) ^ (((quadrant + 1U) & 2U) << 62U))};
}

/// sin(u)/u for |u| <= kLargestHalfTurn, within 1.2e-16.
template <class Real>
TRUNDLE_INLINE Real half_sinc(const Real& u) {
  const Real z = u * u;
  return 1.0 + z * (-0x1.5555555555555p-3 +
                    z * (0x1.1111111111102p-7 +
                         z * (-0x1.a01a01a00f001p-13 +
                              z * (0x1.71de3a2675221p-19 +
                                   z * (-0x1.ae63a14b8f1c4p-26 + z * 0x1.5fe21015129d7p-33)))));
}

/// d(sin(u)/u)/du for |u| <= kLargestHalfTurn.
template <class Real>
TRUNDLE_INLINE Real half_sinc_derivative(const Real& u) {
  const Real z = u * u;
  return u *
         (-0x1.5555555555555p-2 +
          z * (0x1.11111111110dcp-5 +
               z * (-0x1.3813813800405p-10 +
                    z * (0x1.71de3a0343491p-16 + z * (-0x1.0cfe178f811b5p-22 + z * 0x1.07c153af44caap-29)))));
}

inline constexpr std::uint64_t kSignBit = 1ULL << 63U;

/// Sets the sign bit where |x| > limit or x is not a number: magnitudes compare as their bits do.
TRUNDLE_INLINE LaneBits beyond(const Lanes& x, double limit) {
  return __builtin_bit_cast(std::uint64_t, limit) - (__builtin_bit_cast(LaneBits, x) & ~kSignBit);
}
/// True if any lane has its sign bit set.
TRUNDLE_INLINE bool any_beyond(const LaneBits& bits) {
  std::uint64_t any = 0;
  for (int lane = 0; lane < kLanes; ++lane) any |= bits[lane];
  return (any & kSignBit) != 0;
}

/// Displacement in world axes along the arc that starts at `heading`: a chord of the length of the path times
/// sinc(θ/2), in the direction of the middle of the turn. docs/odometry.md, eq. 3.
template <class Real>
struct Chord {
  Real x;
  Real y;
};

template <class Real>
TRUNDLE_INLINE Chord<Real> chord_of(const Real& dx, const Real& dy, const SinCos<Real>& middle,
                                    const Real& sinc) {
  const Real along = sinc * middle.cos;
  const Real across = sinc * middle.sin;
  return {along * dx - across * dy, across * dx + along * dy};
}

}  // namespace trundle

#pragma GCC diagnostic pop
