#include "trundle/slam/fastslam/proposal.hpp"

namespace trundle::slam {

PoseProposal::PoseProposal(Proposal kind, const SwarmOptions& swarm, std::size_t particles)
    : kind_(kind), options_(swarm), swarm_(is_of_swarm() ? particles : 0), second_(particles) {}

void PoseProposal::refine(const Step& step, ThreadPool& thread_pool, ParticleSet& particles) {
  if (!is_of_swarm()) return;
  swarm_.refine(
      {particles.predicted, step.by_motion.L, step.by_motion.body_from_sensor, step.readings, step.draw},
      options_, thread_pool, particles.noise);
}

void PoseProposal::draw(const Step& step, ParticleRange range, ParticleSet& particles) {
  if (is_motion()) return;
  TripleColumns& noise = particles.noise;
  if (kind_ != Proposal::swarm && !step.readings.all().empty()) {
    const Matrix3 L = adjoint(step.by_motion.body_from_sensor.inverse()) * step.by_motion.L;
    const bool is_at_optimum = kind_ == Proposal::swarm_gaussian;
    if (is_at_optimum) draw_normals(step.draw, range, second_);
    const GaussianProposal gaussians{particles.sensors, L, is_at_optimum ? &noise : nullptr,
                                     is_at_optimum ? second_ : noise};
    draw_from_gaussians(step.readings, gaussians, range, noise, particles.log_weights.data());
  }
  place(particles.predicted, noise, step.by_motion, range, particles.poses, particles.sensors);
}

}  // namespace trundle::slam
