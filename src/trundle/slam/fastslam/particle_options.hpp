#pragma once

#include "trundle/namespaces.hpp"

namespace trundle::slam {

/// What a filter of particles gives for its pose.
enum class PointEstimate {
  mean,  ///< of all particles, by their weights
  best,  ///< the particle of greatest weight
};

/// Of the swarm: letters as in docs/theory/swarm.md.
struct SwarmOptions {
  int iterations = 5;             ///< K; with target_agreement an upper bound
  double target_agreement = 0.0;  ///< W_set: stop once the mean of exp(−½ d²) is above; 0: never
  double first_inertia = 0.9;     ///< w, falling linearly [Shi & Eberhart 1999]
  double last_inertia = 0.4;
  double cognitive = 1.7;      ///< c1, of the usual 1.5 to 2
  double social = 1.7;         ///< c2, likewise
  double search_radius = 0.5;  ///< of the best agent's first search [σ of the motion]; halves each time
};

}  // namespace trundle::slam
