#pragma once

#include "trundle/slam/fastslam/particle_set.hpp"
#include "trundle/slam/fastslam/proposal_kernels.hpp"
#include "trundle/slam/fastslam/swarm.hpp"

namespace trundle::slam {

/// How particles get their new poses.
enum class Proposal {
  motion,          ///< drawn from the motion: FastSLAM 1.0
  linearised,      ///< from a Gaussian of motion and sightings: FastSLAM 2.0
  swarm,           ///< moved by the swarm, as published: weights know nothing of it
  swarm_gaussian,  ///< from a Gaussian at the swarm's optimum, weighted for it
};

/// The proposal of a particle filter: turns the noise of each particle, drawn from the motion, into that of
/// its new pose, and its log weight takes prior over proposal. A further kind is one more case of these
/// functions. docs/theory/fastslam.md, eq. 15 and 16; docs/theory/swarm.md.
class PoseProposal {
 public:
  PoseProposal(Proposal kind, const SwarmOptions& swarm, std::size_t particles);

  /// Whether poses are drawn from the motion alone, whatever is seen.
  [[nodiscard]] bool is_motion() const { return kind_ == Proposal::motion; }

  struct Step {
    const NearReadings& readings;  ///< of known landmarks
    Placement by_motion;           ///< the motion's noise, as a twist of the body
    Draw draw;                     ///< beyond that of the motion's noise
  };
  /// What all particles find out together, once all are predicted: of the swarms, else nothing.
  void refine(const Step& step, ThreadPool& thread_pool, ParticleSet& particles);
  /// Draws a block of the particles. Their sensors stand at the predictions; of those drawn from the motion
  /// alone all stand where the motion's noise brings them already.
  void draw(const Step& step, ParticleRange range, ParticleSet& particles);

 private:
  [[nodiscard]] bool is_of_swarm() const {
    return kind_ == Proposal::swarm || kind_ == Proposal::swarm_gaussian;
  }

  Proposal kind_;
  SwarmOptions options_;
  Swarm swarm_;
  TripleColumns second_;  ///< draw, where the first is what the swarm has found
};

}  // namespace trundle::slam
