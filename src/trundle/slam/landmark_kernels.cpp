#include "trundle/slam/landmark_kernels.hpp"

#include "trundle/slam/lane_targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/landmark_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/slam/lane_math.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::HWY_NAMESPACE {

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

// Eq. 11.
template <class Real>
HWY_INLINE LaneSight<Real> sight_of(const LaneSensor<Real>& sensor, const ReadingTerms& reading,
                                    const Vector2& offset, const LaneLandmark<Real>& m) {
  using V = Vec<Real>;
  const V dx = (m.x - sensor.x) + lanes<Real>(offset.x());
  const V dy = (m.y - sensor.y) + lanes<Real>(offset.y());
  LaneSight<Real> s;
  s.range = hn::Sqrt(hn::Max(dx * dx + dy * dy, lanes<Real>(1e-12)));
  s.inverse_range = lanes<Real>(1.0) / s.range;
  s.ux = dx * s.inverse_range;
  s.uy = dy * s.inverse_range;
  const V rc = lanes<Real>(reading.cos);
  const V rs = lanes<Real>(reading.sin);
  const V c = sensor.cos * rc - sensor.sin * rs;
  const V d = sensor.sin * rc + sensor.cos * rs;
  s.along = lanes<Real>(reading.range) - s.range;
  s.across = s.range * atan2<Real>(s.ux * d - s.uy * c, s.ux * c + s.uy * d);
  s.r_along = lanes<Real>(reading.range_variance);
  s.r_across = s.range * s.range * lanes<Real>(reading.bearing_variance);
  const V px = m.xx * s.ux + m.xy * s.uy;  // P u
  const V py = m.xy * s.ux + m.yy * s.uy;
  const V qx = m.xy * s.ux - m.xx * s.uy;  // P t
  const V qy = m.yy * s.ux - m.xy * s.uy;
  s.p_along = s.ux * px + s.uy * py;
  s.p_mixed = s.ux * py - s.uy * px;
  s.p_across = s.ux * qy - s.uy * qx;
  s.s_along = s.p_along + s.r_along;
  s.s_across = s.p_across + s.r_across;
  s.determinant = s.s_along * s.s_across - s.p_mixed * s.p_mixed;
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

// Eq. 12.
template <class Real>
HWY_INLINE Vec<Real> log_likelihood_of(const LaneSight<Real>& s, const LaneShift<Real>& shift) {
  const Vec<Real> distance2 = s.along * shift.along + s.across * shift.across;
  return lanes<Real>(-0.5) * (distance2 + log<Real>(s.determinant * s.inverse_range * s.inverse_range));
}

// Eq. 13.
template <class Real>
HWY_INLINE void improve(LaneLandmark<Real>& m, const LaneSight<Real>& s, const LaneShift<Real>& shift) {
  using V = Vec<Real>;
  const V move_along = s.p_along * shift.along + s.p_mixed * shift.across;
  const V move_across = s.p_mixed * shift.along + s.p_across * shift.across;
  const V minor = s.p_along * s.p_across - s.p_mixed * s.p_mixed;
  const V ra = s.r_along * s.inverse_determinant;
  const V rc = s.r_across * s.inverse_determinant;
  const V aa = (minor + s.p_along * s.r_across) * ra;
  const V cc = (minor + s.p_across * s.r_along) * rc;
  const V ac = s.p_mixed * s.r_along * rc;
  const V uxx = s.ux * s.ux;
  const V uyy = s.uy * s.uy;
  const V uxy = s.ux * s.uy;
  const V twice = (ac + ac) * uxy;
  m.x = m.x + (s.ux * move_along - s.uy * move_across);
  m.y = m.y + (s.uy * move_along + s.ux * move_across);
  m.xx = (aa * uxx + cc * uyy) - twice;
  m.xy = (aa - cc) * uxy + ac * (uxx - uyy);
  m.yy = (aa * uyy + cc * uxx) + twice;
}

template <class Real>
void weigh_as(std::span<const KnownReading> readings, const SensorColumns& sensors, ParticleRange range,
              double* log_weights) {
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneSensor<Real> sensor = load_sensor<Real>(sensors, i);
    Vec<Real> sum = hn::Zero(Tag<Real>());
    for (const KnownReading& known : readings) {
      Real* const numbers = known.landmark->numbers<Real>() + i;
      const std::size_t stride = known.landmark->stride();
      LaneLandmark<Real> m = load_landmark(numbers, stride);
      const LaneSight<Real> sight =
          sight_of(sensor, known.reading, known.landmark->origin() - sensors.origin, m);
      const LaneShift<Real> shift = weighted_innovation(sight);
      sum = sum + log_likelihood_of(sight, shift);
      improve(m, sight, shift);
      store_landmark(m, numbers, stride);
    }
    add<Real>(sum, log_weights + i);
  }
}

void weigh(std::span<const KnownReading> readings, const SensorColumns& sensors, ParticleRange range,
           double* log_weights) {
  if (readings.front().landmark->precision() == Precision::float32)
    weigh_as<float>(readings, sensors, range, log_weights);
  else
    weigh_as<double>(readings, sensors, range, log_weights);
}

template <class Real>
void first_as(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
              LandmarkColumns& landmark) {
  const Vector2 offset = sensors.origin - landmark.origin();
  const Vec<Real> rc = lanes<Real>(reading.cos);
  const Vec<Real> rs = lanes<Real>(reading.sin);
  const Vec<Real> aa = lanes<Real>(reading.range_variance);
  const Vec<Real> cc = lanes<Real>(reading.range * reading.range * reading.bearing_variance);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneSensor<Real> sensor = load_sensor<Real>(sensors, i);
    const Vec<Real> ux = sensor.cos * rc - sensor.sin * rs;
    const Vec<Real> uy = sensor.sin * rc + sensor.cos * rs;
    const LaneLandmark<Real> m = {
        (sensor.x + lanes<Real>(offset.x())) + lanes<Real>(reading.range) * ux,
        (sensor.y + lanes<Real>(offset.y())) + lanes<Real>(reading.range) * uy,
        aa * ux * ux + cc * uy * uy,
        (aa - cc) * ux * uy,
        aa * uy * uy + cc * ux * ux,
    };
    store_landmark(m, landmark.numbers<Real>() + i, landmark.stride());
  }
}

void first(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
           LandmarkColumns& landmark) {
  if (landmark.precision() == Precision::float32)
    first_as<float>(reading, sensors, range, landmark);
  else
    first_as<double>(reading, sensors, range, landmark);
}

}  // namespace trundle::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle {

HWY_EXPORT(weigh);
HWY_EXPORT(first);

void weigh_and_improve(std::span<const KnownReading> readings, const SensorColumns& sensors,
                       ParticleRange range, double* log_weights) {
  if (!readings.empty()) HWY_DYNAMIC_DISPATCH(weigh)(readings, sensors, range, log_weights);
}

void set_first_estimates(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
                         LandmarkColumns& landmark) {
  HWY_DYNAMIC_DISPATCH(first)(reading, sensors, range, landmark);
}

}  // namespace trundle
#endif
