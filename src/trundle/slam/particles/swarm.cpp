#include "trundle/slam/particles/swarm.hpp"

#include <algorithm>

namespace trundle {
namespace {

struct Agent {
  Vector3 n;  ///< where it is
  PoseTarget::Value value;
  Vector3 best;  ///< where it was best
  PoseTarget::Value best_value;
  Vector3 velocity = Vector3::Zero();  ///< as a twist

  void go(const Vector3& to, const PoseTarget::Value& there) {
    n = to;
    value = there;
    if (there.log_density <= best_value.log_density) return;
    best = to;
    best_value = there;
  }
};

Vector3 difference(const Pose2& from, const Pose2& to) {
  return log(from.inverse() * to).vector();
}

class Swarm {
 public:
  Swarm(const PoseTarget& target, const SwarmOptions& options, std::size_t particles,
        std::span<Random> random, const TripleColumns& start)
      : target_(target),
        options_(options),
        random_(random),
        lattice_(lattice_of(particles)),
        candidates_(particles),
        values_(particles),
        search_(kCells),
        search_values_(kCells) {
    for (std::size_t i = 0; i < particles; ++i) candidates_.set(i, target.clamped(start.at(i)));
    target_.set_values(candidates_, particles, values_);
    for (std::size_t i = 0; i < particles; ++i)
      agents_.push_back({candidates_.at(i), value(i), candidates_.at(i), value(i)});
  }

  void iterate() {
    double radius = options_.search_radius;
    for (int k = 0; k < options_.iterations; ++k) {
      compete();
      fly(inertia(k));
      search_around_the_best(radius);
      radius *= 0.5;
      if (options_.target_agreement > 0.0 && agreement() >= options_.target_agreement) return;
    }
  }

  const std::vector<Agent>& agents() const { return agents_; }

 private:
  static constexpr std::size_t kCells = 27;  ///< of the best agent's search

  PoseTarget::Value value(std::size_t i) const {
    return {values_.fitness.log_density[i], values_.fitness.agreement[i]};
  }
  Vector3 uniform(std::size_t agent, double low) {
    Random& random = random_[agent / kParticleBlock];
    const double x = random.uniform(low, 1.0);
    const double y = random.uniform(low, 1.0);
    return {x, y, random.uniform(low, 1.0)};
  }

  double inertia(int k) const {
    const double share = options_.iterations > 1 ? k / (options_.iterations - 1.0) : 0.0;
    return options_.first_inertia + share * (options_.last_inertia - options_.first_inertia);
  }

  double agreement() const {
    double sum = 0.0;
    for (const Agent& agent : agents_) sum += agent.best_value.agreement;
    return sum / static_cast<double>(agents_.size());
  }

  std::size_t best_agent() const {
    const auto best = std::ranges::max_element(
        agents_, {}, [](const Agent& agent) { return agent.best_value.log_density; });
    return static_cast<std::size_t>(best - agents_.begin());
  }

  /// Towards the pose where agent i would be at `pose`, within its reach.
  Vector3 reachable(std::size_t i, const Pose2& pose) const {
    return target_.clamped(target_.whitened(i, pose));
  }

  /// Eq. 19. All look at their neighbours as they were before anyone moved.
  void compete() {
    if (lattice_.cells() < 2) return;
    std::vector<Pose2> poses;
    std::vector<double> fitness;
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      poses.push_back(target_.pose(i, agents_[i].n));
      fitness.push_back(agents_[i].value.log_density);
    }
    for (std::size_t i = 0; i < lattice_.cells(); ++i) {
      const auto neighbours = lattice_.neighbours(i);
      const std::size_t m =
          *std::ranges::max_element(neighbours, {}, [&](std::size_t k) { return fitness[k]; });
      const Vector3 r = uniform(i, -1.0);
      candidates_.set(i, agents_[i].n);
      if (fitness[i] >= fitness[m]) continue;
      const Vector3 step = r.cwiseProduct(difference(poses[m], poses[i]));
      candidates_.set(i, reachable(i, poses[m] * exp(Twist2::from(step))));
    }
    target_.set_values(candidates_, agents_.size(), values_);
    for (std::size_t i = 0; i < lattice_.cells(); ++i)
      if (value(i).log_density > agents_[i].value.log_density) agents_[i].go(candidates_.at(i), value(i));
  }

  /// Eq. 20.
  void fly(double inertia) {
    const std::size_t leader = best_agent();
    const Pose2 global_best = target_.pose(leader, agents_[leader].best);
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      Agent& agent = agents_[i];
      const Pose2 here = target_.pose(i, agent.n);
      const Vector3 r1 = uniform(i, 0.0);
      const Vector3 r2 = uniform(i, 0.0);
      const Vector3 to_own = difference(here, target_.pose(i, agent.best));
      const Vector3 to_global = difference(here, global_best);
      agent.velocity = inertia * agent.velocity + options_.cognitive * r1.cwiseProduct(to_own) +
                       options_.social * r2.cwiseProduct(to_global);
      candidates_.set(i, reachable(i, here * exp(Twist2::from(agent.velocity))));
    }
    target_.set_values(candidates_, agents_.size(), values_);
    for (std::size_t i = 0; i < agents_.size(); ++i) agents_[i].go(candidates_.at(i), value(i));
  }

  /// The 26 neighbours on a lattice of the given width.
  void search_around_the_best(double radius) {
    const std::size_t i = best_agent();
    const Vector3 centre = agents_[i].best;
    for (std::size_t cell = 0; cell < kCells; ++cell) {
      const auto side = [](std::size_t k) { return static_cast<double>(k % 3) - 1.0; };
      const Vector3 offset(side(cell), side(cell / 3), side(cell / 9));
      search_.set(cell, target_.clamped(centre + radius * offset));
    }
    target_.set_values_of(i, search_, kCells, search_values_);
    const Fitness& found = search_values_.fitness;
    for (std::size_t cell = 0; cell < kCells; ++cell)
      if (found.log_density[cell] > agents_[i].best_value.log_density)
        agents_[i].go(search_.at(cell), {found.log_density[cell], found.agreement[cell]});
  }

  const PoseTarget& target_;
  const SwarmOptions& options_;
  std::span<Random> random_;
  Lattice lattice_;
  std::vector<Agent> agents_;
  TripleColumns candidates_;  ///< where agents look next
  PoseValues values_;         ///< there
  TripleColumns search_;
  PoseValues search_values_;
};

}  // namespace

std::array<std::size_t, 4> Lattice::neighbours(std::size_t cell) const {
  const std::size_t row = cell / columns;
  const std::size_t column = cell % columns;
  return {row * columns + (column + columns - 1) % columns, row * columns + (column + 1) % columns,
          (row + rows - 1) % rows * columns + column, (row + 1) % rows * columns + column};
}

Lattice lattice_of(std::size_t particles) {
  const auto most_square = [](std::size_t count) {
    std::size_t rows = 1;
    for (std::size_t k = 1; k * k <= count; ++k)
      if (count % k == 0) rows = k;
    return Lattice{rows, rows == 0 ? 0 : count / rows};
  };
  const Lattice all = most_square(particles);
  return all.rows == 1 && particles > 3 ? most_square(particles - 1) : all;
}

void refine_by_swarm(const PoseTarget& target, const SwarmOptions& options, std::size_t particles,
                     std::span<Random> random, TripleColumns& n) {
  if (!target.sees_something() || !target.can_be_searched()) return;
  Swarm swarm(target, options, particles, random, n);
  swarm.iterate();
  for (std::size_t i = 0; i < particles; ++i) n.set(i, swarm.agents()[i].best);
}

}  // namespace trundle
