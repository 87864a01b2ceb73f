#pragma once

#include <array>
#include <vector>

#include "trundle/slam/fastslam/particle_kernels.hpp"
#include "trundle/slam/fastslam/particle_options.hpp"
#include "trundle/slam/fastslam/swarm_kernels.hpp"
#include "trundle/slam/fastslam/thread_pool.hpp"

namespace trundle::slam {

/// The agents' lattice: the most nearly square factorisation of the particles; of a prime number of them one
/// is left out.
struct Lattice {
  std::size_t rows = 0;
  std::size_t columns = 0;

  [[nodiscard]] std::size_t cells() const { return rows * columns; }
  /// Left, right, above, below on the torus.
  [[nodiscard]] std::array<std::size_t, 4> neighbours(std::size_t cell) const;
};
[[nodiscard]] Lattice lattice_of(std::size_t particles);

/// Moves every particle to a better pose: agents on a torus lattice compete with their neighbours, fly as a
/// swarm, and the best of them searches around itself. docs/theory/swarm.md. Room for all of it is kept
/// from step to step.
class Swarm {
 public:
  explicit Swarm(std::size_t particles);

  /// What a step says of each particle's new pose.
  struct Target {
    const PoseColumns& predicted;
    Matrix3 L;  ///< twist = L n
    Pose2 body_from_sensor;
    const NearReadings& readings;
    Draw draw;  ///< purposes from 1 on are free
  };
  /// `n` (whitened, one for each particle) comes in as drawn from the motion and leaves as the best that each
  /// agent has found. Where nothing is seen, or the motion is certain in some direction, it stays.
  void refine(const Target& target, const SwarmOptions& options, ThreadPool& thread_pool, TripleColumns& n);

 private:
  void find_partners(ParticleRange range);
  void search(const SwarmTask& task, double radius);
  [[nodiscard]] std::size_t best_agent() const;
  [[nodiscard]] double agreement() const;

  std::size_t particles_;
  Lattice lattice_;
  std::vector<std::array<std::size_t, 4>> neighbours_;  ///< of each cell
  SwarmColumns agents_;
  PoseColumns poses_;
  BodyColumns predicted_;
  TripleColumns still_;  ///< no noise
  BodyColumns partners_;
  Column<double> partner_values_;
  std::array<TripleColumns, 3> chances_;  ///< to compete, of the own best, of the best of all
  TripleColumns cells_;                   ///< of the best agent's search
  SearchedPlaces found_;
};

}  // namespace trundle::slam
