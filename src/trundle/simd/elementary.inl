// Elementary functions of V, one double or a vector: scalar.hpp and lanes.inl include this text into their
// namespaces, after the operations that it is written in. No library calls, no fused multiply-adds, and no
// branches but those that leave out what no lane needs: every instruction set, every width, and one number
// alone give the same bits.

/// c₀ + x (c₁ + x (...)).
template <class V, class Real, std::size_t N>
TRUNDLE_INLINE V polynomial(const std::array<Real, N>& c, V x) {
  V sum = each<V>(c[N - 1]);
  for (std::size_t i = N - 1; i-- > 0;) sum = sum * x + each<V>(c[i]);
  return sum;
}

template <class V>
struct SinCos {
  V sin, cos;
};

/// cos r, |r| <= π/4.
template <class V>
TRUNDLE_INLINE V cos_of_small(V r) {
  const V z = r * r;
  return each<V>(1.0) - (each<V>(0.5) * z - z * z * polynomial(Coefficients<LaneOf<V>>::kCos, z));
}

/// sin and cos, |r| <= π/4.
template <class V>
TRUNDLE_INLINE SinCos<V> sin_cos_of_small(V r) {
  const V z = r * r;
  return {r + r * z * polynomial(Coefficients<LaneOf<V>>::kSin, z), cos_of_small(r)};
}

/// sin and cos of r + q π/2, |r| <= π/4; q stands in the low bits of `quadrant`.
template <class V>
TRUNDLE_INLINE SinCos<V> sin_cos_in_quadrant(V r, IntegersOf<V> quadrant) {
  using I = IntegersOf<V>;
  constexpr int kToSign = sizeof(LaneOf<V>) * 8 - 2;
  const SinCos<V> of_r = sin_cos_of_small(r);
  const auto exchange = has_bit<V>(quadrant, each<I>(1));
  const I two = each<I>(2);
  return {flip(select(exchange, of_r.cos, of_r.sin), shift_left<kToSign>(quadrant & two)),
          flip(select(exchange, of_r.sin, of_r.cos), shift_left<kToSign>((quadrant + each<I>(1)) & two))};
}

/// Of angles up to kLargestAngle (double) or 1e3 (float) [rad], to 2e-16 or a few units in the last place of
/// 1.
template <class V>
TRUNDLE_INLINE SinCos<V> sin_cos(V x) {
  using K = Coefficients<LaneOf<V>>;
  if (can_leave_out<V>(abs(x) <= each<V>(0.75))) return sin_cos_of_small(x);
  const V shifted = x * each<V>(2.0 / std::numbers::pi) + each<V>(K::kRound);
  const V q = shifted - each<V>(K::kRound);
  const V r = ((x - q * each<V>(K::kHalfPi[0])) - q * each<V>(K::kHalfPi[1])) - q * each<V>(K::kHalfPi[2]);
  return sin_cos_in_quadrant(r, bits_of(shifted));
}

/// sin(u)/u and its derivative, |u| <= kLargestHalfTurn; double alone.
template <class V>
TRUNDLE_INLINE V sinc_of_small(V u) {
  const V z = u * u;
  return each<V>(1.0) + z * polynomial(Coefficients<LaneOf<V>>::kSinc, z);
}
template <class V>
TRUNDLE_INLINE V sinc_slope_of_small(V u) {
  return u * polynomial(Coefficients<LaneOf<V>>::kSincSlope, u * u);
}

/// Displacement in world axes along an arc: a chord of the length of the path times sinc(θ/2), in the
/// direction of the middle of the turn. docs/theory/odometry.md, eq. 3.
template <class V>
struct Chord {
  V x, y;
};

template <class V>
TRUNDLE_INLINE Chord<V> chord_of(V dx, V dy, const SinCos<V>& middle, V sinc) {
  const V along = sinc * middle.cos;
  const V across = sinc * middle.sin;
  return {along * dx - across * dy, across * dx + along * dy};
}

/// atan r, |r| up to tan(π/8).
template <class V>
TRUNDLE_INLINE V atan_of_small(V r) {
  const V z = r * r;
  return r + r * z * polynomial(Coefficients<LaneOf<V>>::kAtan, z);
}

/// Of y and x not both huge or tiny, within 5e-16 · |angle| (double); 0 at (0, 0).
template <class V>
TRUNDLE_INLINE V atan2(V y, V x) {
  constexpr double kPi = std::numbers::pi;
  const V tan_eighth = each<V>(0.41421356237309503);
  const V ax = abs(x);
  const V ay = abs(y);
  if (can_leave_out<V>(both(x >= each<V>(1e-30), ay <= tan_eighth * x)))
    return with_sign_of(y, atan_of_small(ay / x));
  const V smaller = min(ax, ay);
  const V larger = max(max(ax, ay), each<V>(1e-30));
  // atan t = π/4 + atan((t − 1)/(t + 1)) above tan(π/8)
  const auto reduce = smaller > tan_eighth * larger;
  const V r = select(reduce, smaller - larger, smaller) / select(reduce, smaller + larger, larger);
  const V octant = or_zero(reduce, each<V>(0.25 * kPi)) + atan_of_small(r);
  const V quadrant = select(ay > ax, each<V>(0.5 * kPi) - octant, octant);
  const V half = select(x < each<V>(0.0), each<V>(kPi) - quadrant, quadrant);
  return with_sign_of(y, half);
}

/// Of normal positive numbers, to a unit in the last place.
template <class V>
TRUNDLE_INLINE V log(V x) {
  using Real = LaneOf<V>;
  using K = Coefficients<Real>;
  using I = IntegersOf<V>;
  const I root_half = each<I>(K::kRootHalf);  // the mantissa becomes √½ to √2
  const I bits = bits_of(x) - root_half;
  const V k = converted<V>(shift_right<K::kMantissa>(bits));
  const I mantissa = each<I>((LaneOf<I>{1} << K::kMantissa) - 1);
  const V f = number_of<V>((bits & mantissa) + root_half) - each<V>(1.0);
  const V half_square = each<V>(0.5) * f * f;
  if constexpr (sizeof(Real) == sizeof(float)) {
    const V tail = f * f * f * polynomial(K::kLog, f);
    return (f + (tail + k * each<V>(K::kLn2[1]) - half_square)) + k * each<V>(K::kLn2[0]);
  } else {
    const V s = f / (each<V>(2.0) + f);
    const V z = s * s;
    const V low = s * (half_square + z * polynomial(K::kLog, z)) + k * each<V>(K::kLn2[1]);
    return k * each<V>(K::kLn2[0]) - ((half_square - low) - f);
  }
}

/// A sum of logarithms as the logarithm of a product, whose exponent is counted apart so that it neither
/// overflows nor vanishes. Of normal positive numbers.
template <class V>
class LogSum {
 public:
  TRUNDLE_INLINE LogSum() : mantissa_(each<V>(1.0)), exponent_(each<I>(0)) {}
  TRUNDLE_INLINE void add(V x) {
    const I bits = bits_of(mantissa_ * x);
    exponent_ = exponent_ + shift_right<K::kMantissa>(bits);
    const I mantissa = each<I>((LaneOf<I>{1} << K::kMantissa) - 1);
    mantissa_ = number_of<V>((bits & mantissa) | bits_of(each<V>(1.0)));
    bias_ += K::kBias;
  }
  TRUNDLE_INLINE V sum() const {
    return log(mantissa_) + converted<V>(exponent_ - each<I>(bias_)) * each<V>(std::numbers::ln2);
  }

 private:
  using K = Coefficients<LaneOf<V>>;
  using I = IntegersOf<V>;

  V mantissa_;  ///< 1 to 2
  I exponent_;
  LaneOf<I> bias_ = 0;
};

/// Of x <= 709 (double) or 88 (float), to two units in the last place; 0 below kLeastExponent.
template <class V>
TRUNDLE_INLINE V exp(V x) {
  using Real = LaneOf<V>;
  using K = Coefficients<Real>;
  const V least = each<V>(K::kLeastExponent);
  const V limited = max(x, least);
  const V shifted = limited * each<V>(std::numbers::log2e) + each<V>(K::kRound);
  const V k = shifted - each<V>(K::kRound);
  const V r = (limited - k * each<V>(K::kLn2[0])) - k * each<V>(K::kLn2[1]);
  V y = polynomial(K::kExp, r);
  if constexpr (sizeof(Real) == sizeof(float)) y = (r * r * y + r) + each<V>(1.0);
  const V scaled = number_of<V>(bits_of(y) + shift_left<K::kMantissa>(bits_of(shifted)));
  return or_zero(x >= least, scaled);
}
