#include "trundle/slam/models/observation.hpp"

#include <cmath>

namespace trundle::slam {
namespace {

// A landmark on top of the sensor has no bearing: it is taken to be this far away.
constexpr double kLeastRange_m = 1e-6;
// Beyond these no reading means anything, and squares of it would overflow.
constexpr double kMostRange_m = 1e6;
constexpr double kMostBearing_rad = 1e3;  // 160 turns

/// ∂(R b)/∂heading: a lever turned by a quarter.
Vector2 turned(const Vector2& lever) {
  return {-lever.y(), lever.x()};
}

}  // namespace

bool is_valid(const Observation& observation) {
  // Comparisons that not-a-number fails.
  return observation.range_m >= kLeastRange_m && observation.range_m <= kMostRange_m &&
         std::abs(observation.bearing_rad) <= kMostBearing_rad;
}

// Eq. 2a.
Observation observation_of(const LandmarkSensor& sensor, LandmarkId landmark, double range_m,
                           double bearing_rad) {
  const double growth = sensor.range_scale * sensor.along_ray(bearing_rad);
  // What stands where such a sensor has no depth is not seen: no reading is valid there.
  const double range = growth > 0.0 ? (range_m - sensor.range_offset_m) / growth : 0.0;
  return {landmark, range, bearing_rad - sensor.bearing_offset_rad};
}

// Eq. 2 and 3.
ExpectedReading expected_reading(const Pose2& world_from_body, const Pose2& body_from_sensor,
                                 const Vector2& landmark_in_world) {
  const Pose2 world_from_sensor = world_from_body * body_from_sensor;
  const Vector2 d = landmark_in_world - world_from_sensor.translation();
  const double range = std::max(d.norm(), kLeastRange_m);
  ExpectedReading expected{range, wrap_angle(std::atan2(d.y(), d.x()) - world_from_sensor.heading), {}, {}};
  expected.by_landmark.row(0) = d.transpose() / range;
  expected.by_landmark.row(1) = turned(d).transpose() / (range * range);
  const Vector2 lever = world_from_sensor.translation() - world_from_body.translation();
  expected.by_pose.leftCols<2>() = -expected.by_landmark;
  expected.by_pose.col(2) = -(expected.by_landmark * turned(lever)) - Vector2(0.0, 1.0);
  return expected;
}

Vector2 innovation_of(const Observation& observation, const ExpectedReading& expected) {
  return {observation.range_m - expected.range_m, wrap_angle(observation.bearing_rad - expected.bearing_rad)};
}

// Eq. 4.
SightedLandmark sighted_landmark(const Pose2& world_from_body, const Pose2& body_from_sensor,
                                 const Observation& observation) {
  const Pose2 world_from_sensor = world_from_body * body_from_sensor;
  const double direction = world_from_sensor.heading + observation.bearing_rad;
  const Vector2 u(std::cos(direction), std::sin(direction));
  SightedLandmark sighted;
  sighted.in_world = world_from_sensor.translation() + observation.range_m * u;
  sighted.by_pose.leftCols<2>().setIdentity();
  sighted.by_pose.col(2) = turned(sighted.in_world - world_from_body.translation());
  sighted.by_reading.col(0) = u;
  sighted.by_reading.col(1) = observation.range_m * turned(u);
  return sighted;
}

Matrix2 reading_covariance(const LandmarkSensor& sensor) {
  return Vector2(sensor.range_sigma_m * sensor.range_sigma_m,
                 sensor.bearing_sigma_rad * sensor.bearing_sigma_rad)
      .asDiagonal();
}

}  // namespace trundle::slam
