// Elementary functions of many numbers at once, in Highway's vectors: no library calls, no fused
// multiply-adds, and no branches but those that leave out what no lane needs, so that every instruction set,
// and every width, gives the same bits. Included once for each instruction set. Real is float or double.
#if defined(TRUNDLE_SLAM_LANE_MATH) == defined(HWY_TARGET_TOGGLE)
#ifdef TRUNDLE_SLAM_LANE_MATH
#undef TRUNDLE_SLAM_LANE_MATH
#else
#define TRUNDLE_SLAM_LANE_MATH
#endif

#include <array>
#include <cstdint>
#include <limits>

#include <hwy/highway.h>

#include "trundle/geometry/angle.hpp"
#include "trundle/slam/particles/columns.hpp"

HWY_BEFORE_NAMESPACE();
namespace trundle::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class Real>
using Tag = hn::CappedTag<Real, 16>;
template <class Real>
using Vec = hn::Vec<Tag<Real>>;
/// Doubles, as many as there are Reals in a vector.
using Wide = Vec<double>;

template <class Real>
HWY_INLINE Vec<Real> lanes(double x) {
  return hn::Set(Tag<Real>(), static_cast<Real>(x));
}

/// c₀ + x (c₁ + x (...)).
template <class Real, std::size_t N>
HWY_INLINE Vec<Real> polynomial(const std::array<Real, N>& c, Vec<Real> x) {
  Vec<Real> sum = hn::Set(Tag<Real>(), c[N - 1]);
  for (std::size_t i = N - 1; i-- > 0;) sum = sum * x + hn::Set(Tag<Real>(), c[i]);
  return sum;
}

template <class Real>
struct Coefficients;  // of the polynomials below, with the precision of Real

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
  static constexpr std::array<float, 3> kHalfPi = {1.5703125F, 4.837512969970703125e-4F,
                                                   7.54978995489188216e-8F};
  static constexpr float kRound = 0x1.8p23F;
  static constexpr std::int32_t kRootHalf = 0x3f3504f3;
  static constexpr int kMantissa = 23;
};

template <>
struct Coefficients<double> {  // atan: FDLIBM [Sun 1993]; others: fitted at Chebyshev nodes
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
  static constexpr std::array<double, 7> kLog = {
      6.666666666666735130e-01, 3.999999999940941908e-01, 2.857142874366239149e-01, 2.222219843214978396e-01,
      1.818357216161805012e-01, 1.531383769920937332e-01, 1.479819860511658591e-01};
  static constexpr std::array<double, 3> kHalfPi = {0x1.921fb544p+0, 0x1.0b4611a6p-34, 0x1.3198a2ep-69};
  static constexpr double kRound = 0x1.8p52;
  static constexpr std::int64_t kRootHalf = 0x3fe6a09e667f3bcd;
  static constexpr int kMantissa = 52;
};

template <class Real>
using Integers = hn::Vec<hn::RebindToSigned<Tag<Real>>>;

template <class Real>
struct LaneSinCos {
  Vec<Real> sin, cos;
};

/// sin and cos, |r| <= π/4.
template <class Real>
HWY_INLINE LaneSinCos<Real> sin_cos_of_small(Vec<Real> r) {
  using K = Coefficients<Real>;
  const Vec<Real> z = r * r;
  return {r + r * z * polynomial<Real>(K::kSin, z),
          lanes<Real>(1.0) - (lanes<Real>(0.5) * z - z * z * polynomial<Real>(K::kCos, z))};
}

/// sin and cos of r + q π/2, |r| <= π/4; q stands in the low bits of `quadrant`.
template <class Real>
HWY_INLINE LaneSinCos<Real> sin_cos_in_quadrant(Vec<Real> r, Integers<Real> quadrant) {
  const Tag<Real> d;
  const hn::RebindToSigned<Tag<Real>> di;
  const LaneSinCos<Real> of_r = sin_cos_of_small<Real>(r);
  const auto one = hn::Set(di, 1);
  const auto two = hn::Set(di, 2);
  const auto exchange = hn::RebindMask(d, hn::TestBit(quadrant, one));
  const auto sign = [&](Integers<Real> turns) HWY_ATTR {
    return hn::BitCast(d, hn::ShiftLeft<sizeof(Real) * 8 - 2>(hn::And(turns, two)));
  };
  return {hn::Xor(hn::IfThenElse(exchange, of_r.cos, of_r.sin), sign(quadrant)),
          hn::Xor(hn::IfThenElse(exchange, of_r.sin, of_r.cos), sign(hn::Add(quadrant, one)))};
}

/// Of angles up to 1e6 (double) or 1e3 (float) [rad], to a few units in the last place of 1. Where all are
/// small the bits are the same with less work.
template <class Real>
HWY_INLINE LaneSinCos<Real> sin_cos(Vec<Real> x) {
  using K = Coefficients<Real>;
  if (hn::AllTrue(Tag<Real>(), hn::Abs(x) <= lanes<Real>(0.75))) return sin_cos_of_small<Real>(x);
  const Vec<Real> shifted = x * lanes<Real>(2.0 / kPi) + lanes<Real>(K::kRound);
  const Vec<Real> q = shifted - lanes<Real>(K::kRound);
  const Vec<Real> r = ((x - q * lanes<Real>(K::kHalfPi[0])) - q * lanes<Real>(K::kHalfPi[1])) -
                      q * lanes<Real>(K::kHalfPi[2]);
  return sin_cos_in_quadrant<Real>(r, hn::BitCast(hn::RebindToSigned<Tag<Real>>(), shifted));
}

/// atan r, |r| up to tan(π/8).
template <class Real>
HWY_INLINE Vec<Real> atan_of_small(Vec<Real> r) {
  const Vec<Real> z = r * r;
  return r + r * z * polynomial<Real>(Coefficients<Real>::kAtan, z);
}

/// Of y and x not both huge or tiny; 0 at (0, 0). Angles are mostly small: where all are, what others need is
/// left out, and the bits are the same.
template <class Real>
HWY_INLINE Vec<Real> atan2(Vec<Real> y, Vec<Real> x) {
  const Tag<Real> d;
  const Vec<Real> tan_eighth = lanes<Real>(0.41421356237309503);
  const Vec<Real> ax = hn::Abs(x);
  const Vec<Real> ay = hn::Abs(y);
  const auto is_small = hn::And(x >= lanes<Real>(1e-30), ay <= tan_eighth * x);
  if (hn::AllTrue(d, is_small)) return hn::CopySignToAbs(atan_of_small<Real>(ay / x), y);
  const Vec<Real> smaller = hn::Min(ax, ay);
  const Vec<Real> larger = hn::Max(hn::Max(ax, ay), lanes<Real>(1e-30));
  // atan t = π/4 + atan((t − 1)/(t + 1)) above tan(π/8)
  const auto reduce = smaller > tan_eighth * larger;
  const Vec<Real> r =
      hn::IfThenElse(reduce, smaller - larger, smaller) / hn::IfThenElse(reduce, smaller + larger, larger);
  const Vec<Real> octant = hn::IfThenElseZero(reduce, lanes<Real>(0.25 * kPi)) + atan_of_small<Real>(r);
  const Vec<Real> quadrant = hn::IfThenElse(ay > ax, lanes<Real>(0.5 * kPi) - octant, octant);
  const Vec<Real> half = hn::IfThenElse(x < hn::Zero(d), lanes<Real>(kPi) - quadrant, quadrant);
  return hn::CopySignToAbs(half, y);
}

/// Of normal positive numbers, to a unit in the last place.
template <class Real>
HWY_INLINE Vec<Real> log(Vec<Real> x) {
  using K = Coefficients<Real>;
  const Tag<Real> d;
  const hn::RebindToSigned<Tag<Real>> di;
  const auto root_half = hn::Set(di, K::kRootHalf);  // the mantissa becomes √½ to √2
  const auto bits = hn::Sub(hn::BitCast(di, x), root_half);
  const Vec<Real> k = hn::ConvertTo(d, hn::ShiftRight<K::kMantissa>(bits));
  const auto mantissa_bits = hn::Set(di, (hn::TFromD<decltype(di)>{1} << K::kMantissa) - 1);
  const Vec<Real> f = hn::BitCast(d, hn::Add(hn::And(bits, mantissa_bits), root_half)) - lanes<Real>(1.0);
  const Vec<Real> half_square = lanes<Real>(0.5) * f * f;
  if constexpr (sizeof(Real) == sizeof(float)) {
    const Vec<Real> tail = f * f * f * polynomial<Real>(K::kLog, f);
    const Vec<Real> low = tail + k * lanes<Real>(-2.12194440e-4) - half_square;
    return (f + low) + k * lanes<Real>(0.693359375);
  } else {
    const Vec<Real> s = f / (lanes<Real>(2.0) + f);
    const Vec<Real> z = s * s;
    const Vec<Real> R = z * polynomial<Real>(K::kLog, z);
    const Vec<Real> low = s * (half_square + R) + k * lanes<Real>(1.90821492927058770002e-10);
    return k * lanes<Real>(6.93147180369123816490e-01) - ((half_square - low) - f);
  }
}

/// A sum of logarithms as the logarithm of a product, whose exponent is counted apart so that it neither
/// overflows nor vanishes. Of normal positive numbers.
template <class Real>
class LaneLogSum {
 public:
  HWY_INLINE LaneLogSum()
      : mantissa_(lanes<Real>(1.0)), exponent_(hn::Zero(hn::RebindToSigned<Tag<Real>>())) {}
  HWY_INLINE void add(Vec<Real> x) {
    const Tag<Real> d;
    const hn::RebindToSigned<Tag<Real>> di;
    const auto bits = hn::BitCast(di, mantissa_ * x);
    exponent_ = hn::Add(exponent_, hn::ShiftRight<K::kMantissa>(bits));
    const auto mantissa_bits = hn::Set(di, (Integer{1} << K::kMantissa) - 1);
    mantissa_ = hn::BitCast(d, hn::Or(hn::And(bits, mantissa_bits), hn::BitCast(di, lanes<Real>(1.0))));
    bias_ += kBias;
  }
  HWY_INLINE Vec<Real> sum() const {
    const hn::RebindToSigned<Tag<Real>> di;
    const Vec<Real> exponent = hn::ConvertTo(Tag<Real>(), hn::Sub(exponent_, hn::Set(di, bias_)));
    return log<Real>(mantissa_) + exponent * lanes<Real>(0.693147180559945309);
  }

 private:
  using K = Coefficients<Real>;
  using Integer = hn::TFromD<hn::RebindToSigned<Tag<Real>>>;
  static constexpr Integer kBias = std::numeric_limits<Real>::max_exponent - 1;

  Vec<Real> mantissa_;  ///< 1 to 2
  Integers<Real> exponent_;
  Integer bias_ = 0;
};

/// Of x <= 709, to two units in the last place; 0 below −708.
HWY_INLINE Wide exp(Wide x) {
  const Tag<double> d;
  const hn::RebindToSigned<Tag<double>> di;
  constexpr std::array<double, 14> kTaylor = {1.0,
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
  const Wide round = lanes<double>(0x1.8p52);
  const Wide limited = hn::Max(x, lanes<double>(-708.0));
  const Wide shifted = limited * lanes<double>(1.4426950408889634) + round;
  const Wide k = shifted - round;
  const Wide r = (limited - k * lanes<double>(6.93147180369123816490e-01)) -
                 k * lanes<double>(1.90821492927058770002e-10);
  const auto exponent = hn::ShiftLeft<52>(hn::BitCast(di, shifted));
  const Wide y = hn::BitCast(d, hn::Add(hn::BitCast(di, polynomial<double>(kTaylor, r)), exponent));
  return hn::IfThenElseZero(x >= lanes<double>(-708.0), y);
}

/// Of x <= 88, to two units in the last place; 0 below −87. [Moshier, Cephes]
HWY_INLINE Vec<float> exp(Vec<float> x) {
  const Tag<float> d;
  const hn::RebindToSigned<Tag<float>> di;
  constexpr std::array<float, 6> kRest = {5.0000001201e-1F, 1.6666665459e-1F, 4.1665795894e-2F,
                                          8.3334519073e-3F, 1.3981999507e-3F, 1.9875691500e-4F};
  const Vec<float> round = lanes<float>(0x1.8p23);
  const Vec<float> limited = hn::Max(x, lanes<float>(-87.0));
  const Vec<float> shifted = limited * lanes<float>(1.44269504088896341) + round;
  const Vec<float> k = shifted - round;
  const Vec<float> r = (limited - k * lanes<float>(0.693359375)) - k * lanes<float>(-2.12194440e-4);
  const Vec<float> y = (r * r * polynomial<float>(kRest, r) + r) + lanes<float>(1.0);
  const auto exponent = hn::ShiftLeft<23>(hn::BitCast(di, shifted));
  return hn::IfThenElseZero(x >= lanes<float>(-87.0), hn::BitCast(d, hn::Add(hn::BitCast(di, y), exponent)));
}

}  // namespace trundle::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
