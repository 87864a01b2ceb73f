// What a group of particles sees of a landmark, in the lanes of Highway's vectors. Included once for each
// instruction set. Real is float or double.
#if defined(TRUNDLE_SLAM_LANE_SIGHT) == defined(HWY_TARGET_TOGGLE)
#ifdef TRUNDLE_SLAM_LANE_SIGHT
#undef TRUNDLE_SLAM_LANE_SIGHT
#else
#define TRUNDLE_SLAM_LANE_SIGHT
#endif

#include "trundle/slam/fastslam/landmark_kernels.hpp"
#include "trundle/slam/fastslam/lane_columns.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

/// A group of particles' sensors.
template <class Real>
struct LaneSensor {
  Vec<Real> x, y, cos, sin;
};

template <class Real>
HWY_INLINE LaneSensor<Real> load_sensor(const SensorColumns& sensors, std::size_t i) {
  return {load<Real>(sensors.x.data() + i), load<Real>(sensors.y.data() + i),
          load<Real>(sensors.cos.data() + i), load<Real>(sensors.sin.data() + i)};
}

/// One landmark of a group of particles, x and y from the sensors' origin.
template <class Real>
struct LaneLandmark {
  Vec<Real> x, y, xx, xy, yy;
};

template <class Real>
HWY_INLINE LaneLandmark<Real> load_landmark(const Real* numbers, std::size_t stride) {
  const Tag<Real> d;
  return {hn::Load(d, numbers), hn::Load(d, numbers + stride), hn::Load(d, numbers + 2 * stride),
          hn::Load(d, numbers + 3 * stride), hn::Load(d, numbers + 4 * stride)};
}

template <class Real>
HWY_INLINE void store_landmark(const LaneLandmark<Real>& m, Real* numbers, std::size_t stride) {
  const Tag<Real> d;
  hn::Store(m.x, d, numbers);
  hn::Store(m.y, d, numbers + stride);
  hn::Store(m.xx, d, numbers + 2 * stride);
  hn::Store(m.xy, d, numbers + 3 * stride);
  hn::Store(m.yy, d, numbers + 4 * stride);
}

/// Sight of particle_landmark.hpp, in lanes.
template <class Real>
struct LaneSight {
  Vec<Real> range, inverse_range;
  Vec<Real> ux, uy;
  Vec<Real> along, across;               ///< innovation
  Vec<Real> r_along, r_across;           ///< R'
  Vec<Real> p_along, p_mixed, p_across;  ///< P'
  Vec<Real> s_along, s_across;           ///< S' = P' + R', p_mixed off the diagonal
  Vec<Real> determinant, inverse_determinant;
};

/// det S of a 2 × 2 S = P + R, R diagonal: it is never less than det R, whatever rounding does to P, and
/// never 0.
template <class Real>
HWY_INLINE Vec<Real> determinant_of(Vec<Real> along, Vec<Real> mixed, Vec<Real> across, Vec<Real> r_along,
                                    Vec<Real> r_across) {
  return hn::Max(along * across - mixed * mixed, hn::Max(r_along * r_across, lanes<Real>(1e-30)));
}

/// From the sensor to the landmark.
template <class Real>
struct LaneLine {
  Vec<Real> dx, dy;
  Vec<Real> range2;
  Vec<Real> sin, cos;  ///< of the bearing's innovation, times the range
};

template <class Real>
HWY_INLINE LaneLine<Real> line_of(const LaneSensor<Real>& sensor, const NearReading<Real>& reading,
                                  const LaneLandmark<Real>& m) {
  using V = Vec<Real>;
  const Tag<Real> lane;
  const V dx = (m.x - sensor.x) + hn::Set(lane, reading.origin_x);
  const V dy = (m.y - sensor.y) + hn::Set(lane, reading.origin_y);
  const V rc = hn::Set(lane, reading.cos);
  const V rs = hn::Set(lane, reading.sin);
  const V c = sensor.cos * rc - sensor.sin * rs;
  const V d = sensor.sin * rc + sensor.cos * rs;
  return {dx, dy, hn::Max(dx * dx + dy * dy, lanes<Real>(kLeastRange2)), dx * d - dy * c, dx * c + dy * d};
}

// Eq. 11.
template <class Real>
HWY_INLINE LaneSight<Real> sight_of(const LaneSensor<Real>& sensor, const NearReading<Real>& reading,
                                    const LaneLandmark<Real>& m) {
  using V = Vec<Real>;
  const Tag<Real> lane;
  const LaneLine<Real> line = line_of(sensor, reading, m);
  LaneSight<Real> s;
  s.range = hn::Sqrt(line.range2);
  s.inverse_range = lanes<Real>(1.0) / s.range;
  s.ux = line.dx * s.inverse_range;
  s.uy = line.dy * s.inverse_range;
  s.along = hn::Set(lane, reading.range) - s.range;
  s.across = s.range * atan2(line.sin, line.cos);
  s.r_along = hn::Set(lane, reading.range_variance);
  s.r_across = s.range * s.range * hn::Set(lane, reading.bearing_variance);
  const V px = m.xx * s.ux + m.xy * s.uy;  // P u
  const V py = m.xy * s.ux + m.yy * s.uy;
  const V qx = m.xy * s.ux - m.xx * s.uy;  // P t
  const V qy = m.yy * s.ux - m.xy * s.uy;
  s.p_along = s.ux * px + s.uy * py;
  s.p_mixed = s.ux * py - s.uy * px;
  s.p_across = s.ux * qy - s.uy * qx;
  s.s_along = s.p_along + s.r_along;
  s.s_across = s.p_across + s.r_across;
  s.determinant = determinant_of<Real>(s.s_along, s.p_mixed, s.s_across, s.r_along, s.r_across);
  s.inverse_determinant = lanes<Real>(1.0) / s.determinant;
  return s;
}

/// S'⁻¹ ν
template <class Real>
struct LaneShift {
  Vec<Real> along, across;
};

template <class Real>
HWY_INLINE LaneShift<Real> weighted_innovation(const LaneSight<Real>& s) {
  return {(s.s_across * s.along - s.p_mixed * s.across) * s.inverse_determinant,
          (s.s_along * s.across - s.p_mixed * s.along) * s.inverse_determinant};
}

/// What a reading is worth to a particle: log p = ½ (log density2 − distance2). Eq. 12.
template <class Real>
struct LaneFit {
  Vec<Real> distance2;  ///< d²
  Vec<Real> density2;   ///< ρ²/det S'
};

/// In the frame of the line of sight with all lengths times ρ, which needs no unit vectors: besides that of
/// the bearing one division is left.
template <class Real>
HWY_INLINE LaneFit<Real> fit_of(const LaneSensor<Real>& sensor, const NearReading<Real>& reading,
                                const LaneLandmark<Real>& m) {
  using V = Vec<Real>;
  const LaneLine<Real> line = line_of(sensor, reading, m);
  const V& q = line.range2;
  const V range = hn::Sqrt(q);
  const Tag<Real> lane;
  const V along = range * hn::Set(lane, reading.range) - q;
  const V across = q * atan2(line.sin, line.cos);
  const V dx2 = line.dx * line.dx;
  const V dy2 = line.dy * line.dy;
  const V dxy = line.dx * line.dy;
  const V twice = (m.xy + m.xy) * dxy;
  const V r_along = q * hn::Set(lane, reading.range_variance);
  const V r_across = q * (q * hn::Set(lane, reading.bearing_variance));
  const V s_along = (m.xx * dx2 + m.yy * dy2 + twice) + r_along;
  const V s_across = (m.xx * dy2 + m.yy * dx2 - twice) + r_across;
  const V mixed = (m.yy - m.xx) * dxy + m.xy * (dx2 - dy2);
  const V inverse = lanes<Real>(1.0) / determinant_of<Real>(s_along, mixed, s_across, r_along, r_across);
  const V distance2 =
      (along * (s_across * along - mixed * across) + across * (s_along * across - mixed * along)) * inverse;
  return {distance2, q * q * q * inverse};
}

/// Where a sight points in the sensor's own frame: how range and range · bearing change with a twist of the
/// sensor, but for the sign. Rows (cos, sin, 0) and (−sin, cos, range).
template <class Real>
struct LaneDirection {
  Vec<Real> cos, sin;
};

template <class Real>
HWY_INLINE LaneDirection<Real> direction_of(const LaneSensor<Real>& sensor, const LaneSight<Real>& s) {
  return {s.ux * sensor.cos + s.uy * sensor.sin, s.uy * sensor.cos - s.ux * sensor.sin};
}

/// Symmetric 3 × 3.
template <class Real>
struct LaneSymmetric {
  Vec<Real> xx, xy, xh, yy, yh, hh;
};

template <class Real>
HWY_INLINE LaneSymmetric<Real> symmetric(const Matrix3& A) {
  return {lanes<Real>(A(0, 0)), lanes<Real>(A(0, 1)), lanes<Real>(A(0, 2)),
          lanes<Real>(A(1, 1)), lanes<Real>(A(1, 2)), lanes<Real>(A(2, 2))};
}

template <class Real>
struct LaneTriple {
  Vec<Real> x, y, h;
};

template <class Real>
HWY_INLINE LaneTriple<Real> load_triple(const TripleColumns& from, std::size_t i) {
  return {load<Real>(from[0] + i), load<Real>(from[1] + i), load<Real>(from[2] + i)};
}

template <class Real>
HWY_INLINE void store_triple(const LaneTriple<Real>& v, TripleColumns& to, std::size_t i) {
  store<Real>(v.x, to[0] + i);
  store<Real>(v.y, to[1] + i);
  store<Real>(v.h, to[2] + i);
}

template <class Real>
HWY_INLINE LaneTriple<Real> operator+(const LaneTriple<Real>& a, const LaneTriple<Real>& b) {
  return {a.x + b.x, a.y + b.y, a.h + b.h};
}
template <class Real>
HWY_INLINE LaneTriple<Real> operator-(const LaneTriple<Real>& a, const LaneTriple<Real>& b) {
  return {a.x - b.x, a.y - b.y, a.h - b.h};
}
template <class Real>
HWY_INLINE Vec<Real> dot(const LaneTriple<Real>& a, const LaneTriple<Real>& b) {
  return a.x * b.x + a.y * b.y + a.h * b.h;
}

template <class Real>
HWY_INLINE LaneTriple<Real> times(const LaneSymmetric<Real>& A, const LaneTriple<Real>& v) {
  return {A.xx * v.x + A.xy * v.y + A.xh * v.h, A.xy * v.x + A.yy * v.y + A.yh * v.h,
          A.xh * v.x + A.yh * v.y + A.hh * v.h};
}

/// L of a twist = L n.
template <class Real>
struct LaneMatrix {
  std::array<LaneTriple<Real>, 3> columns;
};

template <class Real>
HWY_INLINE LaneMatrix<Real> matrix(const Matrix3& A) {
  LaneMatrix<Real> lane;
  for (int k = 0; k < 3; ++k)
    lane.columns[static_cast<std::size_t>(k)] = {lanes<Real>(A(0, k)), lanes<Real>(A(1, k)),
                                                 lanes<Real>(A(2, k))};
  return lane;
}

template <class Real>
HWY_INLINE LaneTriple<Real> times(const LaneMatrix<Real>& A, const LaneTriple<Real>& v) {
  const auto& [a, b, c] = A.columns;
  return {a.x * v.x + b.x * v.y + c.x * v.h, a.y * v.x + b.y * v.y + c.y * v.h,
          a.h * v.x + b.h * v.y + c.h * v.h};
}

template <class Real>
HWY_INLINE LaneTriple<Real> transposed_times(const LaneMatrix<Real>& A, const LaneTriple<Real>& v) {
  return {dot(A.columns[0], v), dot(A.columns[1], v), dot(A.columns[2], v)};
}

/// sensor · exp(twist).
template <class Real>
HWY_INLINE LaneSensor<Real> moved(const LaneSensor<Real>& sensor, const LaneTriple<Real>& twist) {
  const Vec<Real> u = lanes<Real>(0.5) * twist.h;
  const SinCos<Vec<Real>> half = sin_cos(u);
  const auto tiny = hn::Abs(u) < lanes<Real>(1e-4);
  const Vec<Real> sinc =
      hn::IfThenElse(tiny, lanes<Real>(1.0), half.sin / hn::IfThenElse(tiny, lanes<Real>(1.0), u));
  const Vec<Real> c = sensor.cos * half.cos - sensor.sin * half.sin;  // in the middle of the turn
  const Vec<Real> s = sensor.sin * half.cos + sensor.cos * half.sin;
  const Vec<Real> along = sinc * twist.x;
  const Vec<Real> across = sinc * twist.y;
  return {sensor.x + (c * along - s * across), sensor.y + (s * along + c * across),
          c * half.cos - s * half.sin, s * half.cos + c * half.sin};
}

/// S' + A Q Aᵀ, Q the covariance of a twist of the sensor.
template <class Real>
struct LaneTotal {
  Vec<Real> along, mixed, across;
  Vec<Real> determinant;
};

template <class Real>
HWY_INLINE LaneTotal<Real> total_covariance(const LaneSymmetric<Real>& Q, const LaneSensor<Real>& sensor,
                                            const LaneSight<Real>& s) {
  const LaneDirection<Real> at = direction_of(sensor, s);
  const Vec<Real> zero = hn::Zero(Tag<Real>());
  const LaneTriple<Real> along = {at.cos, at.sin, zero};
  const LaneTriple<Real> across = {zero - at.sin, at.cos, s.range};
  const LaneTriple<Real> Qa = times(Q, along);
  const LaneTriple<Real> Qc = times(Q, across);
  const Vec<Real> aa = s.s_along + dot(along, Qa);
  const Vec<Real> ac = s.p_mixed + dot(across, Qa);
  const Vec<Real> cc = s.s_across + dot(across, Qc);
  return {aa, ac, cc, determinant_of<Real>(aa, ac, cc, s.r_along, s.r_across)};
}

template <class Real>
HWY_INLINE Vec<Real> nis_of(const LaneSight<Real>& s, const LaneTotal<Real>& S) {
  return (s.along * (S.across * s.along - S.mixed * s.across) +
          s.across * (S.along * s.across - S.mixed * s.along)) /
         S.determinant;
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
