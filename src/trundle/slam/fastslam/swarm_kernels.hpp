#pragma once

#include <span>

#include "trundle/slam/fastslam/landmark_kernels.hpp"

namespace trundle::slam {

// The swarm's moves, eq. 19 and 20 of docs/theory/swarm.md and eq. 15 of docs/theory/fastslam.md, of many
// particles at once, in single precision; the same bytes on every machine.

/// Where bodies stand, from a place near them all, and where they head for.
using BodyColumns = SensorColumns;

/// What is the same for all particles and moves of a step.
struct SwarmTask {
  const NearReadings& readings;
  const BodyColumns& predicted;  ///< at n = 0
  Matrix3 L;                     ///< twist of the body = L n
  Matrix3 inverse;               ///< of L
  Vector3 reach;                 ///< of the twist
  SensorAt sensor;               ///< on the body
  bool wants_agreement;
};

/// Every particle searches for the maximum of J(n).
struct SwarmColumns {
  explicit SwarmColumns(std::size_t particles)
      : n(particles),
        velocity(particles),
        best_n(particles),
        at(particles),
        best_at(particles),
        value(padded(particles)),
        best_value(padded(particles)),
        best_agreement(padded(particles)) {}

  TripleColumns n;
  TripleColumns velocity;  ///< as a twist
  TripleColumns best_n;    ///< where it was best
  BodyColumns at, best_at;
  Column<double> value;  ///< J
  Column<double> best_value;
  Column<double> best_agreement;  ///< there: mean over the readings of exp(−½ d²)
};

/// All start from `n`, within their reach: 3 σ of each coordinate of L n.
void start_swarm(const SwarmTask& task, const TripleColumns& n, ParticleRange range, SwarmColumns& swarm);

/// Eq. 19: each that has a better partner may step relative to it, by chances in (0, 1), and does where J
/// rises.
struct Competition {
  const BodyColumns& partners;
  const Column<double>& partner_values;
  const TripleColumns& chances;
};
void compete(const SwarmTask& task, const Competition& by, ParticleRange range, SwarmColumns& swarm);

/// Eq. 20.
struct Flight {
  const TripleColumns& chances_of_own;
  const TripleColumns& chances_of_all;
  SensorAt leader;  ///< where the best of all is, for some may already have flown
  double inertia, cognitive, social;
};
void fly(const SwarmTask& task, const Flight& by, ParticleRange range, SwarmColumns& swarm);

/// J of one particle at many places around n: centre + radius · offset, within its reach.
struct Search {
  std::size_t particle;
  Vector3 centre;
  double radius;
  const TripleColumns& offsets;
};
struct SearchedPlaces {
  explicit SearchedPlaces(std::size_t places)
      : n(places), value(padded(places)), agreement(padded(places)), at(places) {}

  TripleColumns n;
  Column<double> value;
  Column<double> agreement;
  BodyColumns at;
};
void search_around(const SwarmTask& task, const Search& by, ParticleRange range, SearchedPlaces& found);

}  // namespace trundle::slam
