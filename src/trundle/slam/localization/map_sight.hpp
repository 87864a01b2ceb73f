#pragma once

#include <span>
#include <vector>

#include "trundle/slam/localization/known_map.hpp"
#include "trundle/slam/models/motion.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// Poses closer to each other than this are one hypothesis. Below half the distance between neighbouring
/// landmarks, above what a filter's 3 σ are: two filters would take the same sightings for the same
/// landmarks.
struct SamePlace {
  double place_m = 0.5;                ///< [m]
  double heading_rad = radians(10.0);  ///< [rad]
};

/// Whether a pose is so sure that all that it may be, to 3 σ, is one hypothesis.
[[nodiscard]] bool is_one_place(const PoseEstimate& belief, const SamePlace& same);

/// What finding the way on a known map takes beside map and sensor.
struct MapSightOptions {
  double gate = kDefaultGate;    ///< NIS above which a sighting is an outlier
  double outlier_share = 0.05;   ///< of the sightings that show no landmark of the map, or the wrong one
  std::size_t most_pairs = 6;    ///< of points, from which poses are looked for in one step: bounds its time
  double log_odds_range = 16.0;  ///< below the best hypothesis, beyond which one is dropped: e⁻¹⁶ = 1e-7
  SamePlace same = {};
};

/// One reading of one landmark of a known map, as it is expected from a pose.
/// docs/theory/localization.md, eq. 42.
struct MapSight {
  ExpectedReading expected;
  Vector2 innovation;  ///< (range, bearing)
  Matrix2 S;           ///< covariance of the innovation
  double nis = 0.0;
  double log_density = 0.0;  ///< of the reading [1/(m rad)]
};
[[nodiscard]] MapSight map_sight(const PoseEstimate& belief, const LandmarkSensor& sensor,
                                 const KnownLandmark& landmark, const Observation& observation);

/// Landmarks that a reading without a name might show: those about where it points.
[[nodiscard]] std::vector<LandmarkId> candidates(const PoseEstimate& belief, const KnownMap& map,
                                                 const LandmarkSensor& sensor, const Observation& observation,
                                                 double gate);

/// How a pose that was made of landmarks of the map follows the place of one of them.
struct LandmarkGain {
  LandmarkId landmark;
  Eigen::Matrix<double, 3, 2> by_landmark;  ///< derivative of (x, y, heading) [1, rad/m]
};

/// Which landmark each observation shows: its own id; where it has none, the most probable explanation of all
/// of them together (docs/theory/association.md, eq. 21). kUnknownLandmark: invalid, not in the map, or none
/// fits.
[[nodiscard]] std::vector<LandmarkId> identify(const PoseEstimate& belief, const KnownMap& map,
                                               const LandmarkSensor& sensor,
                                               std::span<const Observation> observations, double gate);

/// A reading by what it was taken for.
struct GatedReading {
  ObservationReport report = {.decision = Decision::rejected};
  /// log of how much better it fits 'the robot is somewhere else' than 'it is here': eq. 43.
  double against = 0.0;
};
/// `sight`: of the landmark that the reading was taken for; nothing: it fits none. One without an id might
/// have been any of those in view.
[[nodiscard]] GatedReading gated(const Observation& observation, LandmarkId landmark, const MapSight* sight,
                                 double in_view, const LandmarkSensor& sensor,
                                 const MapSightOptions& options);
/// Whether it is a reading of a landmark that the map may have.
[[nodiscard]] inline bool may_be_mapped(const Observation& observation, const KnownMap& map) {
  return is_valid(observation) && (observation.landmark == kUnknownLandmark || map.has(observation.landmark));
}

/// The Kalman update with a reading: its innovation, derivative H by (x, y, heading), the innovation's
/// covariance S and, of that, the part that the pose has nothing to do with. Eq. 44.
struct PoseReading {
  Vector2 innovation;
  Matrix23 H;
  Matrix2 S;
  Matrix2 noise;
};
void update(const PoseReading& reading, PoseEstimate& belief);

/// (x, y, heading) in the world's axes.
[[nodiscard]] Vector3 difference(const Pose2& from, const Pose2& to);

/// Where a belief is after a motion. Eq. 41.
[[nodiscard]] PoseEstimate moved(const PoseEstimate& belief, const Motion& motion);
/// What it is after a reading of its first systematic error, if it has any.
void read_bias(const BiasReading& reading, PoseEstimate& belief);

/// A pose of which nothing has to do with the systematic errors of `odometry`, and those.
[[nodiscard]] PoseEstimate with_systematic(const PoseEstimate& pose, const PoseEstimate& odometry);

/// Covariance of pose and systematic errors together.
using BodyCovariance =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 + kMostSystematic, 3 + kMostSystematic>;
[[nodiscard]] BodyCovariance body_covariance_of(const PoseEstimate& belief);
void set_body_covariance(const BodyCovariance& covariance, PoseEstimate& belief);

}  // namespace trundle::slam
