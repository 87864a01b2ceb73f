#pragma once

#include "trundle/slam/localization/localizer.hpp"

namespace trundle::test {
using namespace slam;

struct FieldOptions {
  int landmarks = 30;
  double side_m = 30.0;
  double outlier_share = 0.02;  ///< sightings that show nothing of the map
  int seen_at_once = 3;         ///< at most
  double range_sigma_m = 0.1;
  double bearing_sigma_rad = radians(1.0);
  bool symmetric = false;            ///< each landmark has a twin beyond the middle
  int without_twin = 0;              ///< so many more, that have none
  std::vector<Vector2> layout = {};  ///< if given: these are all the landmarks
  std::uint64_t seed = 1;
};

/// A robot that wanders through a field of known landmarks at 0.5 m/s, 10 steps a second, and looks around
/// twice a second.
class Field {
 public:
  explicit Field(const FieldOptions& options) : options_(options), random_(options.seed, 5) {
    sensor_.range_sigma_m = options.range_sigma_m;
    sensor_.bearing_sigma_rad = options.bearing_sigma_rad;
    std::vector<KnownLandmark> landmarks;
    for (const Vector2& place : options.layout) landmarks.push_back({place});
    const int at_random = options.layout.empty() ? options.landmarks + options.without_twin : 0;
    for (int i = 0; i < at_random; ++i) {
      const Vector2 place(random_.uniform(0.0, options.side_m), random_.uniform(0.0, options.side_m));
      landmarks.push_back({place});
      if (options.symmetric && i < options.landmarks)
        landmarks.push_back({Vector2(options.side_m, options.side_m) - place});
    }
    map_.emplace(std::move(landmarks), 2.0 * sensor_.max_range_m);
    carry_away();
  }

  const KnownMap& map() const { return *map_; }
  const LandmarkSensor& sensor() const { return sensor_; }
  const Pose2& truth() const { return truth_; }

  /// Where the robot would be if the map were turned half around.
  Pose2 opposite() const {
    return {options_.side_m - truth_.x, options_.side_m - truth_.y, wrap_angle(truth_.heading + kPi)};
  }

  /// Somewhere else, unnoticed by the odometry.
  void carry_away() {
    truth_ = {random_.uniform(3.0, options_.side_m - 3.0), random_.uniform(3.0, options_.side_m - 3.0),
              random_.uniform(-kPi, kPi)};
  }

  SlamStep step(bool named) {
    ++steps_;
    const Twist2 twist{kStep_m, 0.0, turn()};
    Matrix3 covariance = Vector3(4e-6, 1e-7, 2.5e-5).asDiagonal();
    const Twist2 error{random_.normal(2e-3), random_.normal(std::sqrt(1e-7)), random_.normal(5e-3)};
    truth_ = truth_ * exp(twist) * exp(error);
    SlamStep step{0.1 * steps_, motion_of(twist, covariance), {}};
    if (steps_ % 5 == 0) look_around(named, step.observations);
    return step;
  }

 private:
  static constexpr double kStep_m = 0.05;

  /// Back to the middle where the edge comes near.
  double turn() {
    if (steps_ % 20 == 0) rate_ = random_.uniform(-0.06, 0.06);
    const Vector2 middle(0.5 * options_.side_m, 0.5 * options_.side_m);
    const Vector2 home = middle - truth_.translation();
    if (home.norm() < 0.35 * options_.side_m) return rate_;
    return std::clamp(wrap_angle(std::atan2(home.y(), home.x()) - truth_.heading), -0.06, 0.06);
  }

  void look_around(bool named, std::vector<Observation>& seen) {
    auto near = map_->within((truth_ * sensor_.body_from_sensor).translation(), sensor_.max_range_m);
    while (!near.empty() && seen.size() < static_cast<std::size_t>(options_.seen_at_once)) {
      const auto which = static_cast<std::ptrdiff_t>(random_.below(near.size()));
      const LandmarkId id = near[static_cast<std::size_t>(which)];
      near.erase(near.begin() + which);
      const ExpectedReading exact = expected_reading(truth_, sensor_.body_from_sensor, (*map_)[id].position);
      Observation observation{named ? id : kUnknownLandmark,
                              exact.range_m + random_.normal(sensor_.range_sigma_m),
                              wrap_angle(exact.bearing_rad + random_.normal(sensor_.bearing_sigma_rad))};
      if (random_.uniform() < options_.outlier_share) {
        observation.range_m = random_.uniform(0.5, sensor_.max_range_m);
        observation.bearing_rad = random_.uniform(-kPi, kPi);
      }
      seen.push_back(observation);
    }
  }

  FieldOptions options_;
  Random random_;
  LandmarkSensor sensor_{{0.2, 0.05, 0.1}, 0.1, radians(1.0), 8.0, 0.0};
  std::optional<KnownMap> map_;
  Pose2 truth_;
  int steps_ = 0;
  double rate_ = 0.0;
};

inline bool is_right(const std::optional<PoseEstimate>& estimate, const Pose2& truth) {
  if (!estimate) return false;
  const Pose2 apart = estimate->pose.inverse() * truth;
  return apart.translation().norm() < 0.3 && std::abs(wrap_angle(apart.heading)) < radians(5.0);
}

}  // namespace trundle::test
