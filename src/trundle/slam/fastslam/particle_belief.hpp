#pragma once

#include "trundle/slam/fastslam/particle_map.hpp"
#include "trundle/slam/fastslam/particle_paths.hpp"
#include "trundle/slam/fastslam/particle_set.hpp"

namespace trundle::slam {

/// The belief of a particle filter: each particle is a path, with a Kalman filter for each landmark given
/// that path. While nothing is seen the motion, which is the same for all, is only summed up.
struct ParticleBelief {
  ParticleSet particles;
  ParticleMap map;
  ParticlePaths paths;
  PendingMotion pending;  ///< since the poses were drawn

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.particles, self.map, self.paths, self.pending);
  }
};

/// One more motion: eq. 9.
void predict(const Motion& motion, ParticleBelief& belief);
/// Poses have been drawn, with the noise that stands in the particles: a Kalman filter for each particle's
/// systematic errors, given its path. The drawn pose is a measurement of S s, whose error against the
/// prediction is L n. Eq. 10.
void learn_systematic(ParticleBelief& belief);
/// They have been weighed, too.
void add_keyframe(ParticleBelief& belief);
/// Particles that have come where they are with another bias are less likely. Eq. 10b.
void read_bias(const BiasReading& reading, ParticleBelief& belief);

}  // namespace trundle::slam
