#include "trundle/calibration/likelihood/relative_sum_kernels.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/calibration/likelihood/relative_sum_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/simd/lanes.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::calibration::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

struct Vector {
  Wide x, y;
};

struct HalfTurn {
  Wide cos, sin, sinc, sinc_slope;
};

/// Of θ/2 = `half`: by polynomials, in lanes beyond their range by the library.
HWY_INLINE HalfTurn half_turn(Wide half) {
  const Tag<double> d;
  const Wide sinc_half = sinc_of_small(half);
  HalfTurn parts{cos_of_small(half), half * sinc_half, sinc_half, sinc_slope_of_small(half)};
  if (hn::AllTrue(d, abs(half) <= lanes<double>(kLargestHalfTurn))) return parts;
  alignas(64) RelativeSum u, c, s, q, slope;
  hn::Store(half, d, u.data());
  hn::Store(parts.cos, d, c.data());
  hn::Store(parts.sin, d, s.data());
  hn::Store(parts.sinc, d, q.data());
  hn::Store(parts.sinc_slope, d, slope.data());
  for (std::size_t lane = 0; lane < hn::Lanes(d); ++lane) {
    if (std::abs(u[lane]) <= kLargestHalfTurn) continue;
    c[lane] = std::cos(u[lane]);
    s[lane] = std::sin(u[lane]);
    q[lane] = sinc(u[lane]);
    slope[lane] = sinc_derivative(u[lane]);
  }
  return {hn::Load(d, c.data()), hn::Load(d, s.data()), hn::Load(d, q.data()), hn::Load(d, slope.data())};
}

HWY_INLINE Wide wrapped(Wide angle) {
  const Wide round = lanes<double>(Coefficients<double>::kRound);
  const Wide turns = (angle * lanes<double>(0.5 / kPi) + round) - round;
  return angle - turns * lanes<double>(2.0 * kPi);
}

struct Twists {
  Wide dx, dy, turn;
};
using InputLanes = std::array<Wide, kMaxInputs>;

HWY_INLINE Twists twists(const RelativeConstants& is, const InputLanes& u) {
  const auto T = [&](std::size_t i) HWY_ATTR { return lanes<double>(is.T[i]); };
  Twists twist{u[0] * T(0), u[0] * T(1), u[0] * T(2)};
  for (std::size_t k = 1; k < is.inputs; ++k) {
    twist.dx = twist.dx + u[k] * T(3 * k);
    twist.dy = twist.dy + u[k] * T(3 * k + 1);
    twist.turn = twist.turn + u[k] * T(3 * k + 2);
  }
  return twist;
}

/// Predictions in body axes, v = t + (R(θ) − 1) l with the chord t, and their derivatives:
/// A by the twist, with columns (a, b, 0), (−b, a, 0), (p, q, 1); S by ℓ, with columns (c, s, 0), (−s, c, 0)
/// and (vy, −vx, 0), where R(θ) − 1 = [c −s; s c].
struct Prediction {
  Vector v;
  Wide turn;
  Wide a, b, p, q, c, s;
};

HWY_INLINE Prediction predict(const RelativeConstants& is, const Twists& twist) {
  const HalfTurn half = half_turn(lanes<double>(0.5) * twist.turn);
  const Wide a = half.sinc * half.cos;
  const Wide b = half.sinc * half.sin;
  const Vector t = {a * twist.dx - b * twist.dy, b * twist.dx + a * twist.dy};
  const Wide c = lanes<double>(-2.0) * half.sin * half.sin;
  const Wide s = lanes<double>(2.0) * half.sin * half.cos;
  const Vector l = {lanes<double>(is.lever_x), lanes<double>(is.lever_y)};
  const Vector lever = {c * l.x - s * l.y, s * l.x + c * l.y};
  const Wide bent_x = half.sinc_slope * (half.cos * twist.dx - half.sin * twist.dy);
  const Wide bent_y = half.sinc_slope * (half.sin * twist.dx + half.cos * twist.dy);
  return {{t.x + lever.x, t.y + lever.y},
          twist.turn,
          a,
          b,
          lanes<double>(0.5) * (bent_x - t.y) - (lever.y + l.y),
          lanes<double>(0.5) * (bent_y + t.x) + (lever.x + l.x),
          c,
          s};
}

/// Ω
struct Information {
  Wide xx, xy, xh, yy, yh, hh;
};
HWY_INLINE Information information(const RelativeConstants& is) {
  const auto& [xx, xy, xh, yy, yh, hh] = is.omega;
  return {lanes<double>(xx), lanes<double>(xy), lanes<double>(xh),
          lanes<double>(yy), lanes<double>(yh), lanes<double>(hh)};
}

/// Ω r, and what each increment costs; beyond the gate it has no weight.
struct Residual {
  Wide x, y, turn;  ///< of Ω r, times the weight
  Wide weight, cost;
};

HWY_INLINE Residual residual(const RelativeConstants& is, const Prediction& at, const Vector& measured,
                             Wide measured_turn) {
  const auto [Oxx, Oxy, Oxh, Oyy, Oyh, Ohh] = information(is);
  const Wide cos_mount = lanes<double>(is.cos_mount);
  const Wide sin_mount = lanes<double>(is.sin_mount);
  const Wide x = cos_mount * measured.x - sin_mount * measured.y - at.v.x;
  const Wide y = sin_mount * measured.x + cos_mount * measured.y - at.v.y;
  const Wide turn = wrapped(measured_turn - at.turn);
  const Wide fx = Oxx * x + Oxy * y + Oxh * turn;
  const Wide fy = Oxy * x + Oyy * y + Oyh * turn;
  const Wide fh = Oxh * x + Oyh * y + Ohh * turn;
  const Wide cost = x * fx + y * fy + turn * fh;
  const Wide gate = lanes<double>(is.gate);
  const auto passes = cost <= gate;
  return {or_zero(passes, fx), or_zero(passes, fy), or_zero(passes, fh), or_zero(passes, lanes<double>(1.0)),
          select(passes, cost, gate)};
}

/// To as many columns of a sum, the first of which is `lane`.
HWY_INLINE void add(Wide x, std::size_t lane, RelativeSum& sum) {
  const Tag<double> d;
  hn::Store(hn::Load(d, &sum[lane]) + x, d, &sum[lane]);
}

HWY_INLINE void add_chassis(const RelativeConstants& is, const InputLanes& u, const Prediction& at,
                            const Residual& f, std::size_t lane, RelativeSums& sums) {
  const auto [Oxx, Oxy, Oxh, Oyy, Oyh, Ohh] = information(is);
  const auto& [v, turn, a, b, p, q, c, s] = at;
  const Vector A1 = {Oxx * a + Oxy * b, Oxy * a + Oyy * b};  // columns of Ω A
  const Vector A2 = {Oxy * a - Oxx * b, Oyy * a - Oxy * b};
  const Vector A3 = {Oxx * p + Oxy * q + Oxh, Oxy * p + Oyy * q + Oyh};
  const Wide A3h = Oxh * p + Oyh * q + Ohh;
  const std::array<Wide, 6> AA = {A1.x * a + A1.y * b, A2.x * a + A2.y * b, A3.x * a + A3.y * b,
                                  A2.y * a - A2.x * b, A3.y * a - A3.x * b, A3.x * p + A3.y * q + A3h};
  const std::array<Wide, 9> AS = {A1.x * c + A1.y * s, A1.y * c - A1.x * s, A1.x * v.y - A1.y * v.x,
                                  A2.x * c + A2.y * s, A2.y * c - A2.x * s, A2.x * v.y - A2.y * v.x,
                                  A3.x * c + A3.y * s, A3.y * c - A3.x * s, A3.x * v.y - A3.y * v.x};
  const std::array<Wide, 3> Ar = {a * f.x + b * f.y, a * f.y - b * f.x, p * f.x + q * f.y + f.turn};
  std::size_t pair = 0;
  for (std::size_t i = 0; i < is.inputs; ++i) {
    const Wide wu = f.weight * u[i];
    for (std::size_t k = 0; k < 9; ++k) add(wu * AS[k], lane, sums.crossed[i][k]);
    for (std::size_t k = 0; k < 3; ++k) add(u[i] * Ar[k], lane, sums.chassis_gradient[i][k]);
    for (std::size_t j = i; j < is.inputs; ++j, ++pair) {
      const Wide wuu = wu * u[j];
      for (std::size_t k = 0; k < 6; ++k) add(wuu * AA[k], lane, sums.chassis[pair][k]);
    }
  }
}

HWY_INLINE void add_sensor(const RelativeConstants& is, const Prediction& at, const Residual& f,
                           std::size_t lane, RelativeSums& sums) {
  const auto [Oxx, Oxy, Oxh, Oyy, Oyh, Ohh] = information(is);
  const auto& [v, turn, a, b, p, q, c, s] = at;
  const Vector S1 = {Oxx * c + Oxy * s, Oxy * c + Oyy * s};  // columns of Ω S
  const Vector S2 = {Oxy * c - Oxx * s, Oyy * c - Oxy * s};
  const Vector S3 = {Oxx * v.y - Oxy * v.x, Oxy * v.y - Oyy * v.x};
  add(f.weight * (S1.x * c + S1.y * s), lane, sums.sensor[0]);
  add(f.weight * (S2.x * c + S2.y * s), lane, sums.sensor[1]);
  add(f.weight * (S3.x * c + S3.y * s), lane, sums.sensor[2]);
  add(f.weight * (S2.y * c - S2.x * s), lane, sums.sensor[3]);
  add(f.weight * (S3.y * c - S3.x * s), lane, sums.sensor[4]);
  add(f.weight * (S3.x * v.y - S3.y * v.x), lane, sums.sensor[5]);
  add(c * f.x + s * f.y, lane, sums.sensor_gradient[0]);
  add(c * f.y - s * f.x, lane, sums.sensor_gradient[1]);
  add(v.y * f.x - v.x * f.y, lane, sums.sensor_gradient[2]);
}

/// Rows from `first`; beyond the last one zeros, which add nothing.
HWY_INLINE Wide load(std::span<const double> column, std::size_t first) {
  const Tag<double> d;
  if (first + hn::Lanes(d) <= column.size()) return hn::LoadU(d, column.data() + first);
  alignas(64) RelativeSum rows{};
  std::copy(column.begin() + static_cast<std::ptrdiff_t>(first), column.end(), rows.begin());
  return hn::Load(d, rows.data());
}

void sum_rows(const RelativeColumns& columns, const RelativeConstants& constants, RelativeSums& sums) {
  InputLanes u;
  for (std::size_t i = 0; i < columns.rows(); i += hn::Lanes(Tag<double>())) {
    const std::size_t lane = i % kRelativeLanes;
    for (std::size_t k = 0; k < constants.inputs; ++k) u[k] = load(columns.input[k], i);
    const Prediction at = predict(constants, twists(constants, u));
    const Vector measured = {load(columns.x_m, i), load(columns.y_m, i)};
    const Residual f = residual(constants, at, measured, load(columns.heading_rad, i));
    add(f.cost, lane, sums.cost);
    add(lanes<double>(1.0) - f.weight, lane, sums.outliers);
    add_chassis(constants, u, at, f, lane, sums);
    add_sensor(constants, at, f, lane, sums);
  }
}

}  // namespace trundle::calibration::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::calibration {

HWY_EXPORT(sum_rows);

void sum_relative(const RelativeColumns& columns, const RelativeConstants& constants, RelativeSums& sums) {
  HWY_DYNAMIC_DISPATCH(sum_rows)(columns, constants, sums);
}

}  // namespace trundle::calibration
#endif
