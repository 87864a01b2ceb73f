#pragma once

#include <array>
#include <span>
#include <vector>

#include "trundle/slam/ancestry.hpp"
#include "trundle/slam/particle_landmark.hpp"
#include "trundle/slam/report.hpp"

namespace trundle {

/// One landmark in the maps of all particles: x, y, xx, xy, yy, each a column by particle.
class LandmarkColumns {
 public:
  explicit LandmarkColumns(std::size_t particles) : numbers_(5 * particles), particles_(particles) {}

  std::span<double> column(std::size_t k) { return {numbers_.data() + k * particles_, particles_}; }
  LandmarkEstimate at(std::size_t particle) const {
    const double* first = numbers_.data() + particle;
    return {first[0], first[particles_], first[2 * particles_], first[3 * particles_], first[4 * particles_]};
  }
  void set(std::size_t particle, const LandmarkEstimate& m) {
    double* first = numbers_.data() + particle;
    first[0] = m.x;
    first[particles_] = m.y;
    first[2 * particles_] = m.xx;
    first[3 * particles_] = m.xy;
    first[4 * particles_] = m.yy;
  }

 private:
  std::vector<double> numbers_;
  std::size_t particles_;
};

/// The maps of all particles, landmark by landmark. Resampling leaves them alone: a landmark's columns are
/// brought up to now when it is seen again.
class ParticleMap {
 public:
  explicit ParticleMap(std::size_t particles) : particles_(particles) {}

  std::size_t landmarks() const { return entries_.size(); }
  /// Number of a landmark in this map; kUnknownLandmark: none.
  LandmarkId find(LandmarkId id) const;
  LandmarkId add(LandmarkId id, Ancestry& ancestry);
  /// Columns of today's particles, for reading and writing.
  LandmarkColumns& current(LandmarkId landmark, Ancestry& ancestry);
  void count_sighting(LandmarkId landmark) { ++entries_[static_cast<std::size_t>(landmark)].sightings; }

  /// Mean and covariance over all particles with these weights, which sum to 1. Eq. 17.
  MappedLandmark mixture(LandmarkId landmark, std::span<const double> weights,
                         const Ancestry& ancestry) const;

 private:
  struct Entry {
    LandmarkId id;
    Ancestry::Epoch epoch;
    LandmarkColumns columns;
    std::size_t sightings;
  };

  std::size_t particles_;
  std::vector<Entry> entries_;
  std::vector<LandmarkId> index_of_;  ///< by id
};

}  // namespace trundle
