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
HWY_INLINE void improve(LaneLandmark& m, const LaneSight& s, const LaneShift& shift) {
  using V = Vec<float>;
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

void weigh(const NearReadings& readings, const SensorColumns& sensors, ParticleRange range,
           double* log_weights) {
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneSensor sensor = load_sensor(sensors, i);
    Vec<float> distance2 = hn::Zero(Tag<float>());
    LogSum<Vec<float>> volumes2;
    for (const NearReading& reading : readings.all()) {
      float* const numbers = reading.landmark->numbers() + i;
      const std::size_t stride = reading.landmark->stride();
      LaneLandmark m = load_landmark(numbers, stride);
      const LaneSight sight = sight_of(sensor, reading, m);
      const LaneShift shift = weighted_innovation(sight);
      distance2 = distance2 + (sight.along * shift.along + sight.across * shift.across);
      volumes2.add(sight.determinant * sight.inverse_range * sight.inverse_range);
      improve(m, sight, shift);
      store_landmark(m, numbers, stride);
    }
    add(lanes<float>(-0.5) * (distance2 + volumes2.sum()), log_weights + i);
  }
}

void first(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
           LandmarkColumns& landmark) {
  const Vector2 offset = sensors.origin - landmark.origin();
  const Vec<float> rc = lanes<float>(reading.cos);
  const Vec<float> rs = lanes<float>(reading.sin);
  const Vec<float> aa = lanes<float>(reading.range_variance);
  const Vec<float> cc = lanes<float>(reading.range * reading.range * reading.bearing_variance);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneSensor sensor = load_sensor(sensors, i);
    const Vec<float> ux = sensor.cos * rc - sensor.sin * rs;
    const Vec<float> uy = sensor.sin * rc + sensor.cos * rs;
    const LaneLandmark m = {
        (sensor.x + lanes<float>(offset.x())) + lanes<float>(reading.range) * ux,
        (sensor.y + lanes<float>(offset.y())) + lanes<float>(reading.range) * uy,
        aa * ux * ux + cc * uy * uy,
        (aa - cc) * ux * uy,
        aa * uy * uy + cc * ux * ux,
    };
    store_landmark(m, landmark.numbers() + i, landmark.stride());
  }
}

void gather(const LandmarkColumns& from, const Column<std::uint32_t>& ancestors, ParticleRange range,
            LandmarkColumns& to) {
  const Tag<float> d;
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(d)) {
    const auto index =
        hn::BitCast(hn::RebindToSigned<Tag<float>>(), hn::Load(Tag<std::uint32_t>(), ancestors.data() + i));
    for (std::size_t k = 0; k < LandmarkColumns::kColumns; ++k)
      hn::Store(hn::GatherIndex(d, from.numbers() + k * from.stride(), index), d,
                to.numbers() + k * to.stride() + i);
  }
}

// Eq. 14.
void innovations_of(const KnownReading& known, const SensorColumns& sensors, const Matrix3& covariance,
                    ParticleRange range, TripleColumns& innovations) {
  const LaneSymmetric Q = symmetric(covariance);
  const NearReading reading = near(known, sensors.origin);
  for (std::size_t i = range.first; i < range.last; i += hn::Lanes(Tag<float>())) {
    const LaneSensor sensor = load_sensor(sensors, i);
    const LaneSight s =
        sight_of(sensor, reading, load_landmark(known.landmark->numbers() + i, known.landmark->stride()));
    const Vec<float> nis = nis_of(s, total_covariance(Q, sensor, s));
    store_triple({s.along, s.across * s.inverse_range, nis}, innovations, i);
  }
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
  readings_.clear();
  for (const KnownReading& known : readings) readings_.push_back(near(known, origin));
}

void weigh_and_improve(const NearReadings& readings, const SensorColumns& sensors, ParticleRange range,
                       double* log_weights) {
  if (!readings.all().empty()) HWY_DYNAMIC_DISPATCH(weigh)(readings, sensors, range, log_weights);
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
