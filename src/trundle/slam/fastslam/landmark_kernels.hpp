#pragma once

#include <span>
#include <vector>

#include "trundle/slam/fastslam/landmark_columns.hpp"
#include "trundle/slam/fastslam/particle_landmark.hpp"

namespace trundle::slam {

// What each particle makes of its sightings: eq. 11 to 14 of docs/theory/fastslam.md for many particles at
// once, in single precision; the same bytes on every machine. particle_landmark.hpp has the same arithmetic
// for one, in double.

/// A reading of a landmark that the map has.
struct KnownReading {
  ReadingTerms reading;
  LandmarkColumns* landmark;  ///< of today's particles
};

/// Of a reading, what lanes load.
struct NearReading {
  float range, cos, sin;
  float range_variance, bearing_variance;
  float origin_x, origin_y;  ///< the landmark's, from that of the sensors
  LandmarkColumns* landmark;
};
[[nodiscard]] inline NearReading near(const KnownReading& known, const Vector2& origin) {
  const auto [range, cos, sin, range_variance, bearing_variance] = known.reading;
  const Vector2 apart = known.landmark->origin() - origin;
  return {static_cast<float>(range),
          static_cast<float>(cos),
          static_cast<float>(sin),
          static_cast<float>(range_variance),
          static_cast<float>(bearing_variance),
          static_cast<float>(apart.x()),
          static_cast<float>(apart.y()),
          known.landmark};
}

/// The readings of a step, made once for all that is computed of them.
class NearReadings {
 public:
  NearReadings() = default;
  /// `origin` is that of the sensors.
  NearReadings(std::span<const KnownReading> readings, const Vector2& origin) { set(readings, origin); }
  void set(std::span<const KnownReading> readings, const Vector2& origin);
  [[nodiscard]] const Vector2& origin() const { return origin_; }
  [[nodiscard]] std::span<const NearReading> all() const { return readings_; }

 private:
  Vector2 origin_ = Vector2::Zero();
  std::vector<NearReading> readings_;
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
