#pragma once

#include <span>

#include "trundle/slam/particles/landmark_columns.hpp"
#include "trundle/slam/particles/particle_landmark.hpp"

namespace trundle {

// What each particle makes of its sightings: eq. 11 to 16 of docs/slam.md for many particles at once, in the
// precision of the map; the same bytes on every machine. particle_landmark.hpp has the same arithmetic for
// one.

/// A reading of a landmark that the map has.
struct KnownReading {
  ReadingTerms reading;
  LandmarkColumns* landmark;  ///< of today's particles
};

/// to = what each particle has from its ancestor: the columns of an older epoch brought up to now. The origin
/// has to be the same.
void gather_landmark(const LandmarkColumns& from, const Column<std::uint32_t>& ancestors, ParticleRange range,
                     LandmarkColumns& to);

/// Every particle's landmarks take their readings in turn; log weights take what each reading says of the
/// particle. Eq. 11 to 13.
void weigh_and_improve(std::span<const KnownReading> readings, const SensorColumns& sensors,
                       ParticleRange range, double* log_weights);

/// A landmark seen for the first time.
void set_first_estimates(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
                         LandmarkColumns& landmark);

/// What each particle sees in one reading before it is drawn: innovations of range [m] and bearing [rad], and
/// their square in the covariance of landmark, reading and the sensor's own uncertainty, that of a twist in
/// its frame. Eq. 14.
void set_surprises(const KnownReading& known, const SensorColumns& sensors, const Matrix3& sensor_covariance,
                   ParticleRange range, TripleColumns& surprises);

/// The Gaussian of each particle's pose after its sightings, in n of eq. 15, of which each draws one: eq. 16.
struct GaussianProposal {
  const SensorColumns& predicted;       ///< at n = 0
  Matrix3 L;                            ///< twist of the sensor = L n
  const TripleColumns* from = nullptr;  ///< where it is linearised first; none: at n = 0
  const TripleColumns& z;               ///< standard normal numbers; may be the same columns as `n`
};
/// n = a draw; log weights take prior over proposal.
void draw_from_gaussians(std::span<const KnownReading> readings, const GaussianProposal& proposal,
                         ParticleRange range, TripleColumns& n, double* log_weights);

}  // namespace trundle
