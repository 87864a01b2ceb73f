#pragma once

#include "trundle/slam/fastslam/landmark_kernels.hpp"

namespace trundle::slam {

/// The Gaussian of each particle's pose after its sightings, in n of eq. 15, of which each draws one: eq. 16.
struct GaussianProposal {
  const SensorColumns& predicted;       ///< at n = 0
  Matrix3 L;                            ///< twist of the sensor = L n
  const TripleColumns* from = nullptr;  ///< where it is linearised first; none: at n = 0
  const TripleColumns& z;               ///< standard normal numbers; may be the same columns as `n`
};
/// n = a draw; log weights take prior over proposal.
void draw_from_gaussians(const NearReadings& readings, const GaussianProposal& proposal, ParticleRange range,
                         TripleColumns& n, double* log_weights);

}  // namespace trundle::slam
