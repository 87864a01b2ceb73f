// The twist of an interval with steered wheels, of V: one double or a vector. steered_sums.hpp and
// reckon_kernels.cpp include this text into their namespaces, after the elementary functions of V.

/// `input`: of a column; `steering`: the reading of a wheel. docs/theory/odometry.md, eq. 11.
template <class V, class Input, class Steering>
TRUNDLE_INLINE SteeredTwist<V> steered_twist(const SteeredSums& sums, const Input& input,
                                             const Steering& steering) {
  V xx = each<V>(sums.normal[0]), xy = each<V>(sums.normal[1]), xh = each<V>(sums.normal[2]);
  V yy = each<V>(sums.normal[3]), yh = each<V>(sums.normal[4]), hh = each<V>(sums.normal[5]);
  V bx = each<V>(0.0), by = each<V>(0.0), bh = each<V>(0.0);
  for (std::size_t k = 0; k < sums.input_count; ++k) {
    const SteeredSums::Input& term = sums.input[k];
    const V u = input(term.column);
    bx = bx + each<V>(term.by_input[0]) * u;
    by = by + each<V>(term.by_input[1]) * u;
    bh = bh + each<V>(term.by_input[2]) * u;
  }
  V inside = each<V>(kLargestAngle);
  for (std::size_t k = 0; k < sums.wheel_count; ++k) {
    const SteeredSums::Wheel& wheel = sums.wheel[k];
    const V angle = each<V>(wheel.direction_rad) +
                    each<V>(wheel.scale) * (steering(wheel.index) - each<V>(wheel.zero_rad));
    inside = min(inside, each<V>(kLargestAngle) - abs(angle));
    const SinCos<V> along = sin_cos(angle);
    // Of the velocity of its place, weighed along and across; then of the body.
    const V more = each<V>(wheel.rolling - wheel.lateral), lateral = each<V>(wheel.lateral);
    const V x = each<V>(wheel.x_m), y = each<V>(wheel.y_m);
    const V wxx = lateral + more * along.cos * along.cos;
    const V wxy = more * along.cos * along.sin;
    const V wyy = lateral + more * along.sin * along.sin;
    const V wxh = x * wxy - y * wxx, wyh = x * wyy - y * wxy;
    xx = xx + wxx;
    xy = xy + wxy;
    xh = xh + wxh;
    yy = yy + wyy;
    yh = yh + wyh;
    hh = hh + (x * wyh - y * wxh);
    if (wheel.rolling == 0.0) continue;
    const V z = each<V>(wheel.rolling * wheel.metres) * input(wheel.index);
    const V zx = z * along.cos, zy = z * along.sin;
    bx = bx + zx;
    by = by + zy;
    bh = bh + (x * zy - y * zx);
  }
  const V cxx = yy * hh - yh * yh, cxy = xh * yh - xy * hh, cxh = xy * yh - xh * yy;
  const V cyy = xx * hh - xh * xh, cyh = xy * xh - xx * yh, chh = xx * yy - xy * xy;
  const V determinant = xx * cxx + xy * cxy + xh * cxh;
  const V inverse = each<V>(1.0) / determinant;
  return {(cxx * bx + cxy * by + cxh * bh) * inverse, (cxy * bx + cyy * by + cyh * bh) * inverse,
          (cxh * bx + cyh * by + chh * bh) * inverse,
          min(inside, determinant - each<V>(kSmallestDeterminant) * xx * yy * hh)};
}
