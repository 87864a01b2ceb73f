// Vectors of lanes for kernels, and the elementary functions of them. Included once for each instruction set.
#if defined(TRUNDLE_SIMD_LANES) == defined(HWY_TARGET_TOGGLE)
#ifdef TRUNDLE_SIMD_LANES
#undef TRUNDLE_SIMD_LANES
#else
#define TRUNDLE_SIMD_LANES
#endif

#include <array>
#include <cstddef>
#include <numbers>

#include <hwy/highway.h>

#include "trundle/simd/coefficients.hpp"

HWY_BEFORE_NAMESPACE();
namespace trundle::simd::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

template <class Real>
using Tag = hn::CappedTag<Real, 16>;
template <class Real>
using Vec = hn::Vec<Tag<Real>>;
/// Doubles, as many as there are in a vector.
using Wide = Vec<double>;

// What elementary.inl is written in; scalar.hpp has the same for one double.

template <class V>
using LaneOf = hn::TFromV<V>;
template <class V>
using IntegersOf = hn::Vec<hn::RebindToSigned<hn::DFromV<V>>>;

template <class V, class X>
HWY_INLINE V each(X x) {
  return hn::Set(hn::DFromV<V>(), static_cast<LaneOf<V>>(x));
}
template <class Real>
HWY_INLINE Vec<Real> lanes(double x) {
  return each<Vec<Real>>(x);
}
template <class V>
HWY_INLINE V abs(V x) {
  return hn::Abs(x);
}
template <class V>
HWY_INLINE V min(V a, V b) {
  return hn::Min(a, b);
}
template <class V>
HWY_INLINE V max(V a, V b) {
  return hn::Max(a, b);
}
template <class V>
HWY_INLINE V with_sign_of(V sign, V magnitude) {
  return hn::CopySignToAbs(magnitude, sign);
}
template <class M, class V>
HWY_INLINE V select(M mask, V yes, V no) {
  return hn::IfThenElse(mask, yes, no);
}
template <class M, class V>
HWY_INLINE V or_zero(M mask, V yes) {
  return hn::IfThenElseZero(mask, yes);
}
template <class V, class M>
HWY_INLINE bool can_leave_out(M all) {
  return hn::AllTrue(hn::DFromV<V>(), all);
}
template <class M>
HWY_INLINE M both(M a, M b) {
  return hn::And(a, b);
}
template <class V>
HWY_INLINE IntegersOf<V> bits_of(V x) {
  return hn::BitCast(hn::RebindToSigned<hn::DFromV<V>>(), x);
}
template <class V>
HWY_INLINE V number_of(IntegersOf<V> bits) {
  return hn::BitCast(hn::DFromV<V>(), bits);
}
template <class V>
HWY_INLINE V converted(IntegersOf<V> integers) {
  return hn::ConvertTo(hn::DFromV<V>(), integers);
}
template <class V>
HWY_INLINE auto has_bit(IntegersOf<V> bits, IntegersOf<V> bit) {
  return hn::RebindMask(hn::DFromV<V>(), hn::TestBit(bits, bit));
}
template <int kBits, class I>
HWY_INLINE I shift_left(I bits) {
  return hn::ShiftLeft<kBits>(bits);
}
template <int kBits, class I>
HWY_INLINE I shift_right(I bits) {
  return hn::ShiftRight<kBits>(bits);
}
template <class V>
HWY_INLINE V flip(V x, IntegersOf<V> bits) {
  return hn::Xor(x, number_of<V>(bits));
}

#include "trundle/simd/elementary.inl"

}  // namespace trundle::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
