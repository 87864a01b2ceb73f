#include "trundle/slam/fastslam/particle_belief.hpp"

#include "trundle/slam/cholesky.hpp"

namespace trundle::slam {

void predict(const Motion& motion, ParticleBelief& belief) {
  belief.pending.add(motion);
  belief.paths.add(motion);
}

void learn_systematic(ParticleBelief& belief) {
  const PendingMotion& pending = belief.pending;
  if (pending.systematic() == 0) return;
  ParticleSet& particles = belief.particles;
  const auto by_n = (pending.gain() * semidefinite_root(pending.covariance())).eval();
  for (std::size_t i = 0; i < particles.count; ++i)
    particles.systematic.set(
        i, pending.systematic_of(particles.systematic.at(i)) + by_n * particles.noise.at(i));
}

void add_keyframe(ParticleBelief& belief) {
  belief.paths.add_keyframe(belief.particles.poses, belief.particles.ancestry);
  belief.pending.drawn(belief.particles.mean_systematic());
}

void read_bias(const BiasReading& reading, ParticleBelief& belief) {
  if (belief.pending.systematic() == 0) return;
  ParticleSet& particles = belief.particles;
  for (std::size_t i = 0; i < particles.count; ++i)
    particles.log_weights[i] += belief.pending.log_likelihood(reading, particles.systematic.at(i));
  belief.pending.read(reading);
}

}  // namespace trundle::slam
