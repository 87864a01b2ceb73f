#pragma once

#include <array>
#include <span>
#include <vector>

#include "trundle/simulation/random.hpp"
#include "trundle/slam/particles/pose_target.hpp"

namespace trundle {

struct SwarmOptions {
  int iterations = 5;             ///< K; with target_agreement an upper bound
  double target_agreement = 0.0;  ///< W_set: stop once the mean of exp(−½ d²) is above; 0: never
  double first_inertia = 0.9;     ///< w, falling linearly
  double last_inertia = 0.4;
  double cognitive = 1.7;      ///< c1
  double social = 1.7;         ///< c2
  double search_radius = 0.5;  ///< of the best agent's first search [σ of the motion]; halves each time
};

/// Particles are random numbers' users in blocks: each block has a stream of its own, so results do not
/// depend on who works on which block.
inline constexpr std::size_t kParticleBlock = 64;

/// Moves every particle to a better pose: agents on a torus lattice compete with their neighbours, fly as a
/// swarm, and the best of them searches around itself. `n` (whitened, one for each particle) comes in as
/// drawn from the motion and leaves as the best that each agent has found. docs/slam.md, 'The swarm'.
void refine_by_swarm(const PoseTarget& target, const SwarmOptions& options, std::size_t particles,
                     std::span<Random> random, TripleColumns& n);

/// The agents' lattice: the most nearly square factorisation of the particles; of a prime number of them one
/// is left out.
struct Lattice {
  std::size_t rows = 0;
  std::size_t columns = 0;

  std::size_t cells() const { return rows * columns; }
  /// Left, right, above, below on the torus.
  std::array<std::size_t, 4> neighbours(std::size_t cell) const;
};
Lattice lattice_of(std::size_t particles);

}  // namespace trundle
