#pragma once

#include "trundle/odometry/arc.hpp"
#include "trundle/simd/scalar.hpp"
#include "trundle/slam/models/observation.hpp"

namespace trundle::slam {

// One landmark of one particle: a Gaussian in the plane, given the particle's path. Everything is written in
// the frame of the line of sight, u along it and t across, where the bearing times the range is a length:
// docs/theory/fastslam.md, eq. 11 and 12.

/// Mean and covariance in the world.
struct LandmarkEstimate {
  double x, y;
  double xx, xy, yy;
};

/// A particle's landmark sensor: where it stands, where its bearing 0 points.
struct SensorAt {
  double x, y;
  double cos, sin;
};

[[nodiscard]] inline SensorAt sensor_at(const Pose2& world_from_body, const Pose2& body_from_sensor) {
  const auto body = sin_cos_of(world_from_body.heading);
  const double bc = std::cos(body_from_sensor.heading);
  const double bs = std::sin(body_from_sensor.heading);
  return {world_from_body.x + body.cos * body_from_sensor.x - body.sin * body_from_sensor.y,
          world_from_body.y + body.sin * body_from_sensor.x + body.cos * body_from_sensor.y,
          body.cos * bc - body.sin * bs, body.sin * bc + body.cos * bs};
}

/// A reading with what the sensor is worth.
struct ReadingTerms {
  double range;
  double cos, sin;        ///< of the bearing
  double range_variance;  ///< [m²]
  double bearing_variance;
};
[[nodiscard]] inline ReadingTerms reading_terms(const Observation& observation,
                                                const LandmarkSensor& sensor) {
  return {observation.range_m, std::cos(observation.bearing_rad), std::sin(observation.bearing_rad),
          sensor.range_sigma_m * sensor.range_sigma_m, sensor.bearing_sigma_rad * sensor.bearing_sigma_rad};
}

/// What a particle makes of a reading of one of its landmarks.
struct Sight {
  double range;                       ///< expected
  double ux, uy;                      ///< along the line of sight
  double along, across;               ///< innovation [m], the bearing's times `range`
  double r_along, r_across;           ///< noise of the reading, its variance [m²]
  double p_along, p_mixed, p_across;  ///< covariance of the landmark in the same frame
  double determinant;                 ///< of S, landmark and reading together
  double distance2;                   ///< squared innovation in S: χ² with two degrees of freedom
};

/// Nearer than a tenth of a millimetre nothing has a direction [m²].
inline constexpr double kLeastRange2 = 1e-8;

/// Eq. 11, 12. The direction of the reading is turned into the line of sight before the angle between them is
/// taken: it needs no wrapping.
[[nodiscard]] inline Sight sight_of(const SensorAt& sensor, const ReadingTerms& reading,
                                    const LandmarkEstimate& m) {
  const double dx = m.x - sensor.x;
  const double dy = m.y - sensor.y;
  const double square = dx * dx + dy * dy;
  Sight s;
  s.range = std::sqrt(square > kLeastRange2 ? square : kLeastRange2);
  s.ux = dx / s.range;
  s.uy = dy / s.range;
  const double c = sensor.cos * reading.cos - sensor.sin * reading.sin;
  const double d = sensor.sin * reading.cos + sensor.cos * reading.sin;
  s.along = reading.range - s.range;
  s.across = s.range * scalar::atan2(s.ux * d - s.uy * c, s.ux * c + s.uy * d);
  s.r_along = reading.range_variance;
  s.r_across = s.range * s.range * reading.bearing_variance;
  const double px = m.xx * s.ux + m.xy * s.uy;  // P u
  const double py = m.xy * s.ux + m.yy * s.uy;
  s.p_along = s.ux * px + s.uy * py;
  s.p_mixed = s.ux * py - s.uy * px;
  s.p_across = m.xx * s.uy * s.uy - 2.0 * m.xy * s.ux * s.uy + m.yy * s.ux * s.ux;
  const double along = s.p_along + s.r_along;
  const double across = s.p_across + s.r_across;
  s.determinant = along * across - s.p_mixed * s.p_mixed;
  s.distance2 =
      (s.along * s.along * across - 2.0 * s.along * s.across * s.p_mixed + s.across * s.across * along) /
      s.determinant;
  return s;
}

/// A landmark seen for the first time.
[[nodiscard]] inline LandmarkEstimate first_estimate(const SensorAt& sensor, const ReadingTerms& reading) {
  const double ux = sensor.cos * reading.cos - sensor.sin * reading.sin;
  const double uy = sensor.sin * reading.cos + sensor.cos * reading.sin;
  const double aa = reading.range_variance;
  const double cc = reading.range * reading.range * reading.bearing_variance;
  return {sensor.x + reading.range * ux, sensor.y + reading.range * uy, aa * ux * ux + cc * uy * uy,
          (aa - cc) * ux * uy, aa * uy * uy + cc * ux * ux};
}

}  // namespace trundle::slam
