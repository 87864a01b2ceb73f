#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "trundle/chassis/robot.hpp"
#include "trundle/geometry/pose2.hpp"

namespace trundle::slam {

/// Which landmark: 0, 1, 2, ...
using LandmarkId = std::int32_t;
inline constexpr LandmarkId kUnknownLandmark = -1;  ///< nobody has said which

/// One reading of the landmark sensor, and what is known of which landmark it shows.
struct Observation {
  LandmarkId landmark = kUnknownLandmark;  ///< >= 0: the caller's own number of it
  double range_m = 0.0;                    ///< [m], from the sensor
  double bearing_rad = 0.0;                ///< [rad], in the sensor's frame, counter-clockwise

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.landmark, self.range_m, self.bearing_rad);
  }
};

/// A range from 1 µm to 1000 km and a bearing of at most 1000 rad: no NaN, nothing infinite or negative.
[[nodiscard]] bool is_valid(const Observation& observation);

/// What a sensor's reading says of range and bearing, its offsets and scale taken out. Every reading becomes
/// an Observation here, so that filters, localizers and smoother know nothing of them.
/// docs/theory/motion-and-sensor.md, eq. 2a.
[[nodiscard]] Observation observation_of(const LandmarkSensor& sensor, LandmarkId landmark, double range_m,
                                         double bearing_rad);

using Matrix23 = Eigen::Matrix<double, 2, 3>;

/// What the sensor should read of a landmark, (range, bearing), and how that changes.
/// docs/theory/motion-and-sensor.md, eq. 2, 3.
struct ExpectedReading {
  double range_m = 0.0;      ///< [m]
  double bearing_rad = 0.0;  ///< [rad], in the sensor's frame, wrapped
  Matrix23 by_pose;          ///< by (x, y, heading) of the body in world axes
  Matrix2 by_landmark;       ///< by its position in the world
};
[[nodiscard]] ExpectedReading expected_reading(const Pose2& world_from_body, const Pose2& body_from_sensor,
                                               const Vector2& landmark_in_world);

/// Reading minus expectation (range, bearing), the bearing wrapped: a landmark behind the sensor is no
/// special case.
[[nodiscard]] Vector2 innovation_of(const Observation& observation, const ExpectedReading& expected);

/// Where the landmark of a reading is, and how that changes. Eq. 4.
struct SightedLandmark {
  Vector2 in_world;    ///< [m]
  Matrix23 by_pose;    ///< by (x, y, heading) of the body in world axes
  Matrix2 by_reading;  ///< by (range, bearing)

  /// Covariance of the place, by that of the reading alone.
  [[nodiscard]] Matrix2 spread(const Matrix2& R) const { return by_reading * R * by_reading.transpose(); }
};
[[nodiscard]] SightedLandmark sighted_landmark(const Pose2& world_from_body, const Pose2& body_from_sensor,
                                               const Observation& observation);

/// Least angle between two lines of sight that count as independent [rad]: 6°. What errs or hides along the
/// one does so along others within some degrees; a larger angle would only take longer to reach.
inline constexpr double kLeastParallax_rad = 0.1;

/// Whether a reading is independent of one from elsewhere: readings from one place err alike, and what stands
/// in front of a landmark hides it only once. The robot has to move by a tenth of the distance.
[[nodiscard]] inline bool has_parallax(double moved_m, double range_m) {
  return moved_m >= kLeastParallax_rad * range_m;
}

/// Covariance R of a reading, (range, bearing) [m², rad²].
[[nodiscard]] Matrix2 reading_covariance(const LandmarkSensor& sensor);

}  // namespace trundle::slam
