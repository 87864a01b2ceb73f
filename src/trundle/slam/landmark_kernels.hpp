#pragma once

#include <span>

#include "trundle/slam/landmark_columns.hpp"
#include "trundle/slam/particle_landmark.hpp"

namespace trundle {

// What each particle makes of its sightings: eq. 11 to 16 of docs/slam.md for many particles at once, in the
// precision of the map; the same bytes on every machine. particle_landmark.hpp has the same arithmetic for
// one.

/// A reading of a landmark that the map has.
struct KnownReading {
  ReadingTerms reading;
  LandmarkColumns* landmark;  ///< of today's particles
};

/// Every particle's landmarks take their readings in turn; log weights take what each reading says of the
/// particle. Eq. 11 to 13.
void weigh_and_improve(std::span<const KnownReading> readings, const SensorColumns& sensors,
                       ParticleRange range, double* log_weights);

/// A landmark seen for the first time.
void set_first_estimates(const ReadingTerms& reading, const SensorColumns& sensors, ParticleRange range,
                         LandmarkColumns& landmark);

}  // namespace trundle
