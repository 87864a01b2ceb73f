#pragma once

#include <array>
#include <cstdint>

#include "trundle/namespaces.hpp"

#define TRUNDLE_INLINE [[gnu::always_inline]] inline

namespace trundle::simd {

/// Largest angle of sin_cos [rad], and largest |u| of sinc_of_small and its slope [rad], in double.
inline constexpr double kLargestAngle = 1e6;
inline constexpr double kLargestHalfTurn = 0.5;

/// Of the polynomials in elementary.inl, lowest power first, with the precision of Real; and how Real is laid
/// out in bits.
template <class Real>
struct Coefficients;

template <>
struct Coefficients<float> {  // [Moshier, Cephes]
  static constexpr std::array<float, 4> kAtan = {-3.33329491539e-1F, 1.99777106478e-1F, -1.38776856032e-1F,
                                                 8.05374449538e-2F};
  static constexpr std::array<float, 3> kSin = {-1.6666654611e-1F, 8.3321608736e-3F, -1.9515295891e-4F};
  static constexpr std::array<float, 3> kCos = {4.166664568298827e-2F, -1.388731625493765e-3F,
                                                2.443315711809948e-5F};
  static constexpr std::array<float, 9> kLog = {3.3333331174e-1F,  -2.4999993993e-1F, 2.0000714765e-1F,
                                                -1.6668057665e-1F, 1.4249322787e-1F,  -1.2420140846e-1F,
                                                1.1676998740e-1F,  -1.1514610310e-1F, 7.0376836292e-2F};
  static constexpr std::array<float, 6> kExp = {5.0000001201e-1F, 1.6666665459e-1F, 4.1665795894e-2F,
                                                8.3334519073e-3F, 1.3981999507e-3F, 1.9875691500e-4F};
  static constexpr std::array<float, 3> kHalfPi = {1.5703125F, 4.837512969970703125e-4F,
                                                   7.54978995489188216e-8F};
  static constexpr std::array<float, 2> kLn2 = {0.693359375F, -2.12194440e-4F};
  static constexpr float kLeastExponent = -87.0F;
  static constexpr float kRound = 0x1.8p23F;  // adding it rounds to an integer, which stands in the low bits
  static constexpr std::int32_t kRootHalf = 0x3f3504f3;
  static constexpr int kMantissa = 23;
  static constexpr int kBias = 127;
};

template <>
struct Coefficients<double> {  // atan, log: FDLIBM [Sun 1993]; others: fitted at Chebyshev nodes; exp:
                               // Taylor's
  static constexpr std::array<double, 11> kAtan = {
      -3.33333333333329318027e-01, 1.99999999998764832476e-01,  -1.42857142725034663711e-01,
      1.11111104054623557880e-01,  -9.09088713343650656196e-02, 7.69187620504482999495e-02,
      -6.66107313738753120669e-02, 5.83357013379057348645e-02,  -4.97687799461593236017e-02,
      3.65315727442169155270e-02,  -1.62858201153657823623e-02};
  static constexpr std::array<double, 6> kSin = {-0x1.5555555555555p-3,  0x1.1111111110ba5p-7,
                                                 -0x1.a01a019e80693p-13, 0x1.71de379252004p-19,
                                                 -0x1.ae60069e53ef0p-26, 0x1.5e098556d2fd6p-33};
  static constexpr std::array<double, 6> kCos = {0x1.5555555555555p-5,  -0x1.6c16c16c16960p-10,
                                                 0x1.a01a019f4d0edp-16, -0x1.27e4fa15bd814p-22,
                                                 0x1.1eeb66b683027p-29, -0x1.907c0e63adb5ep-37};
  static constexpr std::array<double, 6> kSinc = {-0x1.5555555555555p-3,  0x1.1111111111102p-7,
                                                  -0x1.a01a01a00f001p-13, 0x1.71de3a2675221p-19,
                                                  -0x1.ae63a14b8f1c4p-26, 0x1.5fe21015129d7p-33};
  static constexpr std::array<double, 6> kSincSlope = {-0x1.5555555555555p-2,  0x1.11111111110dcp-5,
                                                       -0x1.3813813800405p-10, 0x1.71de3a0343491p-16,
                                                       -0x1.0cfe178f811b5p-22, 0x1.07c153af44caap-29};
  static constexpr std::array<double, 7> kLog = {
      6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01, 2.222219843214978396e-01,
      1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01};
  static constexpr std::array<double, 14> kExp = {1.0,
                                                  1.0,
                                                  1.0 / 2,
                                                  1.0 / 6,
                                                  1.0 / 24,
                                                  1.0 / 120,
                                                  1.0 / 720,
                                                  1.0 / 5040,
                                                  1.0 / 40320,
                                                  1.0 / 362880,
                                                  1.0 / 3628800,
                                                  1.0 / 39916800,
                                                  1.0 / 479001600,
                                                  1.0 / 6227020800};
  // π/2 in three parts of 33 bits, whose products with integers up to 2²⁰ are exact.
  static constexpr std::array<double, 3> kHalfPi = {0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69};
  static constexpr std::array<double, 2> kLn2 = {6.93147180369123816490e-01, 1.90821492927058770002e-10};
  static constexpr double kLeastExponent = -708.0;
  static constexpr double kRound = 0x1.8p52;
  static constexpr std::int64_t kRootHalf = 0x3fe6a09e667f3bcd;
  static constexpr int kMantissa = 52;
  static constexpr int kBias = 1023;
};

}  // namespace trundle::simd
