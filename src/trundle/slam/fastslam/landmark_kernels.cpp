#include "trundle/slam/fastslam/landmark_kernels.hpp"

#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "trundle/slam/fastslam/landmark_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/slam/fastslam/lane_sight.inl"

HWY_BEFORE_NAMESPACE();
namespace trundle::slam::HWY_NAMESPACE {
using namespace simd::HWY_NAMESPACE;

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
void weigh_as(std::span<const NearReading<Real>> readings, const SensorColumns& sensors, ParticleRange range,
              double* log_weights) {
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneSensor<Real> sensor = load_sensor<Real>(sensors, i);
    Vec<Real> distance2 = hn::Zero(Tag<Real>());
    LogSum<Vec<Real>> volumes2;
    for (const NearReading<Real>& reading : readings) {
      Real* const numbers = reading.landmark->template numbers<Real>() + i;
      const std::size_t stride = reading.landmark->stride();
      LaneLandmark<Real> m = load_landmark(numbers, stride);
      const LaneSight<Real> sight = sight_of(sensor, reading, m);
      const LaneShift<Real> shift = weighted_innovation(sight);
      distance2 = distance2 + (sight.along * shift.along + sight.across * shift.across);
      volumes2.add(sight.determinant * sight.inverse_range * sight.inverse_range);
      improve(m, sight, shift);
      store_landmark(m, numbers, stride);
    }
    add<Real>(lanes<Real>(-0.5) * (distance2 + volumes2.sum()), log_weights + i);
  }
}

void weigh(const NearReadings& readings, const SensorColumns& sensors, ParticleRange range,
           double* log_weights) {
  if (readings.precision() == Precision::float32)
    weigh_as(readings.in<float>(), sensors, range, log_weights);
  else
    weigh_as(readings.in<double>(), sensors, range, log_weights);
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

HWY_INLINE hn::Vec<hn::RebindToSigned<Tag<float>>> load_index(Tag<float>, const std::uint32_t* from) {
  const hn::RebindToSigned<Tag<float>> d;
  return hn::BitCast(d, hn::Load(Tag<std::uint32_t>(), from));
}
HWY_INLINE hn::Vec<hn::RebindToSigned<Tag<double>>> load_index(Tag<double>, const std::uint32_t* from) {
  const hn::RebindToSigned<Tag<double>> d;
  const hn::Rebind<std::int32_t, Tag<double>> narrow;
  return hn::PromoteTo(d, hn::Load(narrow, reinterpret_cast<const std::int32_t*>(from)));
}

template <class Real>
void gather_as(const LandmarkColumns& from, const Column<std::uint32_t>& ancestors, ParticleRange range,
               LandmarkColumns& to) {
  const Tag<Real> d;
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const auto index = load_index(d, ancestors.data() + i);
    for (std::size_t k = 0; k < LandmarkColumns::kColumns; ++k)
      hn::Store(hn::GatherIndex(d, from.numbers<Real>() + k * from.stride(), index), d,
                to.numbers<Real>() + k * to.stride() + i);
  }
}

void gather(const LandmarkColumns& from, const Column<std::uint32_t>& ancestors, ParticleRange range,
            LandmarkColumns& to) {
  if (from.precision() == Precision::float32)
    gather_as<float>(from, ancestors, range, to);
  else
    gather_as<double>(from, ancestors, range, to);
}

// Eq. 14.
template <class Real>
void innovations_as(const KnownReading& known, const SensorColumns& sensors, const Matrix3& covariance,
                    ParticleRange range, TripleColumns& innovations) {
  const LaneSymmetric<Real> Q = symmetric<Real>(covariance);
  const NearReading<Real> reading = near<Real>(known, sensors.origin);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<Real>())) {
    const LaneSensor<Real> sensor = load_sensor<Real>(sensors, i);
    const LaneSight<Real> s = sight_of(
        sensor, reading, load_landmark<Real>(known.landmark->numbers<Real>() + i, known.landmark->stride()));
    const Vec<Real> nis = nis_of(s, total_covariance(Q, sensor, s));
    store_triple<Real>({s.along, s.across * s.inverse_range, nis}, innovations, i);
  }
}

void innovations_of(const KnownReading& known, const SensorColumns& sensors, const Matrix3& covariance,
                    ParticleRange range, TripleColumns& innovations) {
  if (known.landmark->precision() == Precision::float32)
    innovations_as<float>(known, sensors, covariance, range, innovations);
  else
    innovations_as<double>(known, sensors, covariance, range, innovations);
}

}  // namespace trundle::slam::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::slam {

HWY_EXPORT(gather);
HWY_EXPORT(weigh);
HWY_EXPORT(first);
HWY_EXPORT(innovations_of);

void gather_landmark(const LandmarkColumns& from, const Column<std::uint32_t>& ancestors, ParticleRange range,
                     LandmarkColumns& to) {
  HWY_DYNAMIC_DISPATCH(gather)(from, ancestors, range, to);
}

void NearReadings::set(std::span<const KnownReading> readings, const Vector2& origin) {
  origin_ = origin;
  single_.clear();
  double_.clear();
  for (const KnownReading& known : readings)
    if (known.landmark->precision() == Precision::float32)
      single_.push_back(near<float>(known, origin));
    else
      double_.push_back(near<double>(known, origin));
}

void weigh_and_improve(const NearReadings& readings, const SensorColumns& sensors, ParticleRange range,
                       double* log_weights) {
  if (readings.size() > 0) HWY_DYNAMIC_DISPATCH(weigh)(readings, sensors, range, log_weights);
}

void set_first_estimates(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
                         LandmarkColumns& landmark) {
  HWY_DYNAMIC_DISPATCH(first)(reading, sensors, range, landmark);
}

void set_innovations(const KnownReading& known, const SensorColumns& sensors,
                     const Matrix3& sensor_covariance, ParticleRange range, TripleColumns& innovations) {
  HWY_DYNAMIC_DISPATCH(innovations_of)(known, sensors, sensor_covariance, range, innovations);
}

}  // namespace trundle::slam
#endif
