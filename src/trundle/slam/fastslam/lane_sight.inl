// What a group of particles sees of a landmark, in the lanes of Highway's vectors of floats. Included once
// for each instruction set.
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
struct LaneSensor {
  Vec<float> x, y, cos, sin;
};

HWY_INLINE LaneSensor load_sensor(const SensorColumns& sensors, std::size_t i) {
  return {load(sensors.x.data() + i), load(sensors.y.data() + i), load(sensors.cos.data() + i),
          load(sensors.sin.data() + i)};
}

/// One landmark of a group of particles, x and y from the sensors' origin.
struct LaneLandmark {
  Vec<float> x, y, xx, xy, yy;
};

HWY_INLINE LaneLandmark load_landmark(const float* numbers, std::size_t stride) {
  const Tag<float> d;
  return {hn::Load(d, numbers), hn::Load(d, numbers + stride), hn::Load(d, numbers + 2 * stride),
          hn::Load(d, numbers + 3 * stride), hn::Load(d, numbers + 4 * stride)};
}

HWY_INLINE void store_landmark(const LaneLandmark& m, float* numbers, std::size_t stride) {
  const Tag<float> d;
  hn::Store(m.x, d, numbers);
  hn::Store(m.y, d, numbers + stride);
  hn::Store(m.xx, d, numbers + 2 * stride);
  hn::Store(m.xy, d, numbers + 3 * stride);
  hn::Store(m.yy, d, numbers + 4 * stride);
}

/// Sight of particle_landmark.hpp, in lanes.
struct LaneSight {
  Vec<float> range, inverse_range;
  Vec<float> ux, uy;
  Vec<float> along, across;               ///< innovation
  Vec<float> r_along, r_across;           ///< R'
  Vec<float> p_along, p_mixed, p_across;  ///< P'
  Vec<float> s_along, s_across;           ///< S' = P' + R', p_mixed off the diagonal
  Vec<float> determinant, inverse_determinant;
};

/// det S of a 2 × 2 S = P + R, R diagonal: it is never less than det R, whatever rounding does to P, and
/// never 0.
HWY_INLINE Vec<float> determinant_of(Vec<float> along, Vec<float> mixed, Vec<float> across,
                                     Vec<float> r_along, Vec<float> r_across) {
  return hn::Max(along * across - mixed * mixed, hn::Max(r_along * r_across, lanes<float>(1e-30)));
}

/// From the sensor to the landmark.
struct LaneLine {
  Vec<float> dx, dy;
  Vec<float> range2;
  Vec<float> sin, cos;  ///< of the bearing's innovation, times the range
};

HWY_INLINE LaneLine line_of(const LaneSensor& sensor, const NearReading& reading, const LaneLandmark& m) {
  using V = Vec<float>;
  const Tag<float> lane;
  const V dx = (m.x - sensor.x) + hn::Set(lane, reading.origin_x);
  const V dy = (m.y - sensor.y) + hn::Set(lane, reading.origin_y);
  const V rc = hn::Set(lane, reading.cos);
  const V rs = hn::Set(lane, reading.sin);
  const V c = sensor.cos * rc - sensor.sin * rs;
  const V d = sensor.sin * rc + sensor.cos * rs;
  return {dx, dy, hn::Max(dx * dx + dy * dy, lanes<float>(kLeastRange2)), dx * d - dy * c, dx * c + dy * d};
}

// Eq. 11.
HWY_INLINE LaneSight sight_of(const LaneSensor& sensor, const NearReading& reading, const LaneLandmark& m) {
  using V = Vec<float>;
  const Tag<float> lane;
  const LaneLine line = line_of(sensor, reading, m);
  LaneSight s;
  s.range = hn::Sqrt(line.range2);
  s.inverse_range = lanes<float>(1.0) / s.range;
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
  s.determinant = determinant_of(s.s_along, s.p_mixed, s.s_across, s.r_along, s.r_across);
  s.inverse_determinant = lanes<float>(1.0) / s.determinant;
  return s;
}

/// S'⁻¹ ν
struct LaneShift {
  Vec<float> along, across;
};

HWY_INLINE LaneShift weighted_innovation(const LaneSight& s) {
  return {(s.s_across * s.along - s.p_mixed * s.across) * s.inverse_determinant,
          (s.s_along * s.across - s.p_mixed * s.along) * s.inverse_determinant};
}

/// What a reading is worth to a particle: log p = ½ (log density2 − distance2). Eq. 12.
struct LaneFit {
  Vec<float> distance2;  ///< d²
  Vec<float> density2;   ///< ρ²/det S'
};

/// In the frame of the line of sight with all lengths times ρ, which needs no unit vectors: besides that of
/// the bearing one division is left.
HWY_INLINE LaneFit fit_of(const LaneSensor& sensor, const NearReading& reading, const LaneLandmark& m) {
  using V = Vec<float>;
  const LaneLine line = line_of(sensor, reading, m);
  const V& q = line.range2;
  const V range = hn::Sqrt(q);
  const Tag<float> lane;
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
  const V inverse = lanes<float>(1.0) / determinant_of(s_along, mixed, s_across, r_along, r_across);
  const V distance2 =
      (along * (s_across * along - mixed * across) + across * (s_along * across - mixed * along)) * inverse;
  return {distance2, q * q * q * inverse};
}

/// Where a sight points in the sensor's own frame: how range and range · bearing change with a twist of the
/// sensor, but for the sign. Rows (cos, sin, 0) and (−sin, cos, range).
struct LaneDirection {
  Vec<float> cos, sin;
};

HWY_INLINE LaneDirection direction_of(const LaneSensor& sensor, const LaneSight& s) {
  return {s.ux * sensor.cos + s.uy * sensor.sin, s.uy * sensor.cos - s.ux * sensor.sin};
}

/// Symmetric 3 × 3.
struct LaneSymmetric {
  Vec<float> xx, xy, xh, yy, yh, hh;
};

HWY_INLINE LaneSymmetric symmetric(const Matrix3& A) {
  return {lanes<float>(A(0, 0)), lanes<float>(A(0, 1)), lanes<float>(A(0, 2)),
          lanes<float>(A(1, 1)), lanes<float>(A(1, 2)), lanes<float>(A(2, 2))};
}

struct LaneTriple {
  Vec<float> x, y, h;
};

HWY_INLINE LaneTriple load_triple(const TripleColumns& from, std::size_t i) {
  return {load(from[0] + i), load(from[1] + i), load(from[2] + i)};
}

HWY_INLINE void store_triple(const LaneTriple& v, TripleColumns& to, std::size_t i) {
  store(v.x, to[0] + i);
  store(v.y, to[1] + i);
  store(v.h, to[2] + i);
}

HWY_INLINE LaneTriple operator+(const LaneTriple& a, const LaneTriple& b) {
  return {a.x + b.x, a.y + b.y, a.h + b.h};
}
HWY_INLINE LaneTriple operator-(const LaneTriple& a, const LaneTriple& b) {
  return {a.x - b.x, a.y - b.y, a.h - b.h};
}
template <class Mask>
HWY_INLINE LaneTriple where(Mask mask, const LaneTriple& yes, const LaneTriple& no) {
  return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y),
          hn::IfThenElse(mask, yes.h, no.h)};
}

HWY_INLINE Vec<float> dot(const LaneTriple& a, const LaneTriple& b) {
  return a.x * b.x + a.y * b.y + a.h * b.h;
}

HWY_INLINE LaneTriple times(const LaneSymmetric& A, const LaneTriple& v) {
  return {A.xx * v.x + A.xy * v.y + A.xh * v.h, A.xy * v.x + A.yy * v.y + A.yh * v.h,
          A.xh * v.x + A.yh * v.y + A.hh * v.h};
}

/// L of a twist = L n.
struct LaneMatrix {
  std::array<LaneTriple, 3> columns;
};

HWY_INLINE LaneMatrix matrix(const Matrix3& A) {
  LaneMatrix lane;
  for (int k = 0; k < 3; ++k)
    lane.columns[static_cast<std::size_t>(k)] = {lanes<float>(A(0, k)), lanes<float>(A(1, k)),
                                                 lanes<float>(A(2, k))};
  return lane;
}

HWY_INLINE LaneTriple times(const LaneMatrix& A, const LaneTriple& v) {
  const auto& [a, b, c] = A.columns;
  return {a.x * v.x + b.x * v.y + c.x * v.h, a.y * v.x + b.y * v.y + c.y * v.h,
          a.h * v.x + b.h * v.y + c.h * v.h};
}

HWY_INLINE LaneTriple transposed_times(const LaneMatrix& A, const LaneTriple& v) {
  return {dot(A.columns[0], v), dot(A.columns[1], v), dot(A.columns[2], v)};
}

/// sensor · exp(twist).
HWY_INLINE LaneSensor moved(const LaneSensor& sensor, const LaneTriple& twist) {
  const Vec<float> u = lanes<float>(0.5) * twist.h;
  const SinCos<Vec<float>> half = sin_cos(u);
  const auto tiny = hn::Abs(u) < lanes<float>(1e-4);
  const Vec<float> sinc =
      hn::IfThenElse(tiny, lanes<float>(1.0), half.sin / hn::IfThenElse(tiny, lanes<float>(1.0), u));
  const Vec<float> c = sensor.cos * half.cos - sensor.sin * half.sin;  // in the middle of the turn
  const Vec<float> s = sensor.sin * half.cos + sensor.cos * half.sin;
  const Vec<float> along = sinc * twist.x;
  const Vec<float> across = sinc * twist.y;
  return {sensor.x + (c * along - s * across), sensor.y + (s * along + c * across),
          c * half.cos - s * half.sin, s * half.cos + c * half.sin};
}

/// S' + A Q Aᵀ, Q the covariance of a twist of the sensor.
struct LaneTotal {
  Vec<float> along, mixed, across;
  Vec<float> determinant;
};

HWY_INLINE LaneTotal total_covariance(const LaneSymmetric& Q, const LaneSensor& sensor, const LaneSight& s) {
  const LaneDirection at = direction_of(sensor, s);
  const Vec<float> zero = hn::Zero(Tag<float>());
  const LaneTriple along = {at.cos, at.sin, zero};
  const LaneTriple across = {zero - at.sin, at.cos, s.range};
  const LaneTriple Qa = times(Q, along);
  const LaneTriple Qc = times(Q, across);
  const Vec<float> aa = s.s_along + dot(along, Qa);
  const Vec<float> ac = s.p_mixed + dot(across, Qa);
  const Vec<float> cc = s.s_across + dot(across, Qc);
  return {aa, ac, cc, determinant_of(aa, ac, cc, s.r_along, s.r_across)};
}

HWY_INLINE Vec<float> nis_of(const LaneSight& s, const LaneTotal& S) {
  return (s.along * (S.across * s.along - S.mixed * s.across) +
          s.across * (S.along * s.across - S.mixed * s.along)) /
         S.determinant;
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
