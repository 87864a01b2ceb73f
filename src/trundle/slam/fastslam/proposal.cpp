#include "trundle/slam/fastslam/proposal.hpp"

namespace trundle::slam {

PoseProposal::PoseProposal(Proposal kind, const SwarmOptions& swarm, std::size_t particles)
    : kind_(kind), options_(swarm), swarm_(needs_all() ? particles : 0), second_(particles) {}

void PoseProposal::refine(const Step& step, ThreadPool& thread_pool, ParticleSet& particles) {
  swarm_.refine(
      {particles.predicted, step.placement.L, step.placement.body_from_sensor, step.readings, step.draw},
      options_, thread_pool, particles.noise);
}

void PoseProposal::draw(const Step& step, ParticleRange range, ParticleSet& particles) {
  const bool after_swarm = kind_ == Proposal::swarm_gaussian;
  if (after_swarm) draw_normals(step.draw, range, second_);
  const bool is_gaussian = after_swarm || kind_ == Proposal::linearised;
  if (!is_gaussian || step.readings.all().empty()) return;
  const Pose2& body_from_sensor = step.placement.body_from_sensor;
  const Matrix3 L = adjoint(body_from_sensor.inverse()) * step.placement.L;
  TripleColumns& noise = particles.noise;
  place(particles.predicted, noise, {Matrix3::Zero(), body_from_sensor}, range, particles.poses,
        particles.sensors);
  const GaussianProposal gaussians{particles.sensors, L, after_swarm ? &noise : nullptr,
                                   after_swarm ? second_ : noise};
  draw_from_gaussians(step.readings, gaussians, range, noise, particles.log_weights.data());
}

}  // namespace trundle::slam
