#pragma once

#include <vector>

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
  PendingMotion pending;    ///< since the poses were drawn
  Motion since_drawn = {};  ///< the same, whatever the systematic errors: for the paths
  bool keeps_paths = true;

  /// What all particles are near, after the pending motion.
  [[nodiscard]] Pose2 near() const { return particles.poses.at(0) * since_drawn.mean; }
  /// Where the best particle is, after it.
  [[nodiscard]] Pose2 here() const {
    return particles.poses.at(particles.best()) * pending.prediction().mean;
  }
  /// Of the error of a particle's prediction: noise, and what is not known of the systematic errors. In the
  /// frame at its end. Eq. 9.
  [[nodiscard]] const Matrix3& predicted_covariance() const { return pending.covariance(); }

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.particles, self.map, self.paths, self.pending, self.since_drawn);
  }
};

/// One more motion: eq. 9.
void predict(const Motion& motion, ParticleBelief& belief);
/// A step without sightings.
void propagate(ParticleBelief& belief);
/// Poses have been drawn, with the noise that stands in the particles, and weighed.
void add_keyframe(const FrameCovariance& drift, ParticleBelief& belief);
/// A Kalman filter for each particle's systematic errors, given its path: the drawn pose is a measurement of
/// S s, whose error against the prediction is L n. Eq. 10.
void learn_systematic(ParticleBelief& belief);
/// Particles that have come where they are with another bias are less likely. Eq. 10b.
void read_bias(const BiasReading& reading, ParticleBelief& belief);

}  // namespace trundle::slam
