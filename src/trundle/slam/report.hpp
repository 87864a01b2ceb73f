#pragma once

#include <cstddef>
#include <vector>

#include "trundle/slam/models/motion.hpp"
#include "trundle/slam/models/observation.hpp"

namespace trundle::slam {

/// What a filter made of one observation.
enum class Decision {
  matched,   ///< improved the pose and a landmark
  created,   ///< a new landmark
  rejected,  ///< too far from what was expected: an outlier, changed nothing
  invalid,   ///< no number, or range <= 0: changed nothing
};

/// What became of one observation.
struct ObservationReport {
  Decision decision = Decision::invalid;
  LandmarkId landmark = kUnknownLandmark;  ///< its id in the filter's map; none where rejected or invalid
  Vector2 innovation = Vector2::Zero();    ///< (range, bearing) [m, rad]; where matched or rejected
  double nis = 0.0;  ///< innovation squared in its own covariance: χ² with 2 degrees of freedom if consistent

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.decision, self.landmark, self.innovation, self.nis);
  }
};

/// Evidence of one step.
struct StepReport {
  std::vector<ObservationReport> observations;  ///< as they were given
  double effective_particles = 0.0;             ///< 1/Σw² before resampling; 0: the filter has no particles
  double greatest_weight = 0.0;                 ///< of one particle, likewise
  bool resampled = false;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.observations, self.effective_particles, self.greatest_weight, self.resampled);
  }
};

/// Where the robot is, and what its odometry does wrong.
struct PoseEstimate {
  Pose2 pose;                            ///< of the body in the world
  Matrix3 covariance = Matrix3::Zero();  ///< of (x, y, heading) in world axes [m², m rad, rad²]
  Systematic systematic = {};            ///< SystematicErrors (steps.hpp) says which
  SystematicCovariance systematic_covariance = {};
  BySystematic with_systematic = BySystematic(3, 0);  ///< covariance of the pose's errors with those

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.pose, self.covariance, self.systematic, self.systematic_covariance, self.with_systematic);
  }
};

/// What a filter knows at the start.
struct SlamPrior {
  Pose2 start = {};
  Matrix3 start_covariance = Matrix3::Zero();  ///< of (x, y, heading) in world axes
  /// 1σ of each of the odometry's systematic errors; those that motions have beyond are taken for 0.
  Systematic systematic_sigma = {};
};

/// What the gyro read while the robot stood still: the first of the systematic errors.
struct BiasReading {
  double rad_s = 0.0;     ///< less the robot file's
  double variance = 0.0;  ///< of the reading [rad²/s²]

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.rad_s, self.variance);
  }
};

/// What a filter knew of the gyro's bias, less that of the robot file.
struct BiasEstimate {
  double rad_s = 0.0;
  double variance = 0.0;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.rad_s, self.variance);
  }
};

/// One landmark of a map.
struct MappedLandmark {
  LandmarkId id = kUnknownLandmark;      ///< as observed; unidentified: numbered in order of first sight
  Vector2 position = Vector2::Zero();    ///< in the world [m]
  Matrix2 covariance = Matrix2::Zero();  ///< [m²]
  std::size_t sightings = 0;             ///< matched, and the one that created it

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.id, self.position, self.covariance, self.sightings);
  }
};

/// χ² with two degrees of freedom is above it in one consistent sighting out of a thousand.
inline constexpr double kDefaultGate = 13.815510557964274;

}  // namespace trundle::slam
