#pragma once

#include <span>
#include <vector>

#include "trundle/slam/fastslam/landmark_columns.hpp"
#include "trundle/slam/fastslam/particle_landmark.hpp"

namespace trundle::slam {

// What each particle makes of its sightings: eq. 11 to 14 of docs/theory/fastslam.md for many particles at
// once, in the precision of the map; the same bytes on every machine. particle_landmark.hpp has the same
// arithmetic for one.

/// A reading of a landmark that the map has.
struct KnownReading {
  ReadingTerms reading;
  LandmarkColumns* landmark;  ///< of today's particles
};

/// Of a reading, what lanes load: numbers in the precision of the map.
template <class Real>
struct NearReading {
  Real range, cos, sin;
  Real range_variance, bearing_variance;
  Real origin_x, origin_y;  ///< the landmark's, from that of the sensors
  LandmarkColumns* landmark;
};
template <class Real>
[[nodiscard]] NearReading<Real> near(const KnownReading& known, const Vector2& origin) {
  const auto [range, cos, sin, range_variance, bearing_variance] = known.reading;
  const Vector2 apart = known.landmark->origin() - origin;
  return {static_cast<Real>(range),
          static_cast<Real>(cos),
          static_cast<Real>(sin),
          static_cast<Real>(range_variance),
          static_cast<Real>(bearing_variance),
          static_cast<Real>(apart.x()),
          static_cast<Real>(apart.y()),
          known.landmark};
}

/// The readings of a step, made once for all that is computed of them.
class NearReadings {
 public:
  NearReadings() = default;
  /// Of landmarks in one precision. `origin` is that of the sensors.
  NearReadings(std::span<const KnownReading> readings, const Vector2& origin) { set(readings, origin); }
  void set(std::span<const KnownReading> readings, const Vector2& origin);
  [[nodiscard]] const Vector2& origin() const { return origin_; }
  [[nodiscard]] std::size_t size() const { return single_.size() + double_.size(); }
  [[nodiscard]] Precision precision() const {
    return double_.empty() ? Precision::float32 : Precision::float64;
  }
  /// Real is that of the precision.
  template <class Real>
  [[nodiscard]] std::span<const NearReading<Real>> in() const {
    if constexpr (sizeof(Real) == sizeof(float))
      return single_;
    else
      return double_;
  }

 private:
  Vector2 origin_ = Vector2::Zero();
  std::vector<NearReading<float>> single_;
  std::vector<NearReading<double>> double_;
};

/// to = what each particle has from its ancestor: the columns of an older epoch brought up to now. The origin
/// has to be the same.
void gather_landmark(const LandmarkColumns& from, const Column<std::uint32_t>& ancestors, ParticleRange range,
                     LandmarkColumns& to);

/// Every particle's landmarks take their readings in turn; log weights take what each reading says of the
/// particle. Eq. 11 to 13.
void weigh_and_improve(const NearReadings& readings, const SensorColumns& sensors, ParticleRange range,
                       double* log_weights);

/// A landmark seen for the first time.
void set_first_estimates(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
                         LandmarkColumns& landmark);

/// What each particle sees in one reading before it is drawn: innovations of range [m] and bearing [rad], and
/// their square in the covariance of landmark, reading and the sensor's own uncertainty, that of a twist in
/// its frame. Eq. 14.
void set_innovations(const KnownReading& known, const SensorColumns& sensors,
                     const Matrix3& sensor_covariance, ParticleRange range, TripleColumns& innovations);

}  // namespace trundle::slam
