#pragma once

#include <span>

#include "trundle/slam/association/association.hpp"
#include "trundle/slam/fastslam/landmark_columns.hpp"
#include "trundle/slam/fastslam/particle_landmark.hpp"

namespace trundle::slam {

// Which landmark each particle associates an unidentified sighting with, for many particles at once, in
// single precision; the same bytes on every machine. docs/theory/association.md.

/// In place of a landmark, where a particle associates a reading with none of its map.
inline constexpr std::int32_t kNewLandmark = -1;        ///< it shows a new one
inline constexpr std::int32_t kAmbiguousLandmark = -2;  ///< near one of the map, yet outside of its gate

/// A landmark that a reading may show.
struct Candidate {
  LandmarkId landmark;
  LandmarkColumns* columns;  ///< of today's particles
};
/// Of one sighting, for all particles together: twice what one pose may see (kMostShown), for poses differ.
inline constexpr std::size_t kMostCandidates = 16;

/// In place of the cost of a landmark that the particle does not have, or whose gate the reading does not
/// pass: more than any sum of costs that matter, small enough to keep their digits.
inline constexpr double kFar = 1e7;   ///< no landmark of this reading
inline constexpr double kNear = 2e7;  ///< not either, but near enough to be ambiguous

/// What a reading may show, what that costs each particle, and what each takes it for.
struct Hypotheses {
  std::vector<Candidate> candidates = {};
  Column<double> costs = {};          ///< −2 log p, or kFar or kNear: a column for each candidate
  Column<std::int32_t> choices = {};  ///< a landmark, kNewLandmark or kAmbiguousLandmark

  /// No candidate yet.
  void reset(std::size_t particles) {
    candidates.clear();
    choices.resize(padded(particles));
  }
  void add(const Candidate& candidate) {
    candidates.push_back(candidate);
    if (costs.size() < candidates.size() * choices.size()) costs.resize(candidates.size() * choices.size());
  }
  double* costs_of(std::size_t candidate) { return costs.data() + candidate * choices.size(); }
  [[nodiscard]] const double* costs_of(std::size_t candidate) const {
    return costs.data() + candidate * choices.size();
  }
};

/// How particles choose.
struct Choosing {
  const SensorColumns& sensors;
  Matrix3 sensor_covariance;  ///< of a twist in the sensor's frame: its own uncertainty
  AssociationOptions options;
  const double* chance;  ///< uniform in (0, 1), one for each particle
  double* log_weights;   ///< take what a particle could have chosen over what it has chosen
};
/// Costs; and for each particle one of the candidates, or kNewLandmark, or kAmbiguousLandmark, with the
/// probability that the reading shows it if there is no other reading. docs/theory/association.md, eq. 54.
void choose_landmarks(const ReadingTerms& reading, const Choosing& choosing, ParticleRange range,
                      Hypotheses& of);

/// to = what the particles that chose it have of this candidate; the others keep what they have.
void take_chosen(const std::int32_t* choices, const Candidate& from, ParticleRange range,
                 LandmarkColumns& to);

/// Weight of the particles that chose this one: kNewLandmark, kAmbiguousLandmark or a landmark.
[[nodiscard]] double share_that_chose(std::int32_t choice, const Column<std::int32_t>& choices,
                                      const Column<double>& weights);
/// Weight of the particles that have a landmark.
[[nodiscard]] double share_that_has(const LandmarkColumns& landmark, const Column<double>& weights);

}  // namespace trundle::slam
