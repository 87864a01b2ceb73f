#pragma once

#include <cstddef>
#include <vector>

#include "trundle/slam/motion.hpp"
#include "trundle/slam/observation.hpp"

namespace trundle {

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
  double nis = 0.0;  ///< innovation squared in its own covariance: χ² with 2 degrees of freedom if honest

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
  bool closed_loop = false;  ///< the map was bent to what is seen again; `ekf`: the pose was moved to it

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.observations, self.effective_particles, self.greatest_weight, self.resampled,
            self.closed_loop);
  }
};

/// Where the robot is, and what its odometry does wrong.
struct PoseEstimate {
  Pose2 pose;
  Matrix3 covariance = Matrix3::Zero();  ///< of (x, y, heading) in world axes
  Systematic systematic = Systematic::Zero();
  Matrix3 systematic_covariance = Matrix3::Zero();

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.pose, self.covariance, self.systematic, self.systematic_covariance);
  }
};

/// What a filter knows at the start.
struct SlamPrior {
  Pose2 start = {};
  Matrix3 start_covariance = Matrix3::Zero();        ///< of (x, y, heading) in world axes
  Systematic systematic_sigma = Systematic::Zero();  ///< 1σ of the odometry's errors; 0: it has none
};

/// One landmark of a map.
struct MappedLandmark {
  LandmarkId id = kUnknownLandmark;  ///< as observed; without names: numbered in order of first sight
  Vector2 position = Vector2::Zero();
  Matrix2 covariance = Matrix2::Zero();
  std::size_t sightings = 0;  ///< matched, and the one that created it
};

/// χ² with two degrees of freedom is above it in one honest sighting out of a thousand.
inline constexpr double kDefaultGate = 13.815510557964274;

}  // namespace trundle
