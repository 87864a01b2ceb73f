#include "trundle/slam/fastslam/swarm.hpp"

#include <algorithm>
#include <limits>

namespace trundle::slam {
namespace {

// How far agents start and may go from the prediction: 99.7 % of the motion's noise, along each axis.
constexpr double kReachInSigmas = 3.0;
// Of a search: a place and its 26 neighbours in the grid of three coordinates.
constexpr std::size_t kCells = 27;

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

Swarm::Swarm(std::size_t particles)
    : particles_(particles),
      lattice_(lattice_of(particles)),
      agents_(particles),
      poses_(particles),
      predicted_(particles),
      still_(particles),
      partners_(particles),
      partner_values_(padded(particles), -std::numeric_limits<double>::infinity()),
      chances_{TripleColumns(particles), TripleColumns(particles), TripleColumns(particles)},
      cells_(kCells),
      found_(kCells) {
  for (std::size_t i = 0; i < lattice_.cells(); ++i) neighbours_.push_back(lattice_.neighbours(i));
  const auto side = [](std::size_t k) { return static_cast<double>(k % 3) - 1.0; };
  for (std::size_t cell = 0; cell < kCells; ++cell)
    cells_.set(cell, {side(cell), side(cell / 3), side(cell / 9)});
}

void Swarm::refine(const Target& target, const SwarmOptions& options, ThreadPool& thread_pool,
                   TripleColumns& n) {
  if (target.readings.all().empty() || target.L.diagonal().minCoeff() <= 0.0) return;
  predicted_.origin = target.readings.origin();
  const Matrix3 inverse = target.L.triangularView<Eigen::Lower>().solve(Matrix3::Identity());
  const SwarmTask task{target.readings,
                       predicted_,
                       target.L,
                       inverse,
                       kReachInSigmas * target.L.rowwise().norm(),
                       sensor_at({}, target.body_from_sensor),
                       options.target_agreement > 0.0};
  thread_pool.for_all_particles([&](ParticleRange block) {
    place(target.predicted, still_, {}, block, poses_, predicted_);
    start_swarm(task, n, block, agents_);
  });
  double radius = options.search_radius;
  const double slowing = (options.first_inertia - options.last_inertia) / std::max(options.iterations - 1, 1);
  for (int k = 0; k < options.iterations; ++k) {
    const auto purpose = static_cast<std::uint32_t>(1 + k);
    thread_pool.for_all_particles([&](ParticleRange block) {
      draw_chances({target.draw.seed, target.draw.step, purpose}, block, chances_);
      find_partners(block);
    });
    thread_pool.for_all_particles([&](ParticleRange block) {
      compete(task, {partners_, partner_values_, chances_[0]}, block, agents_);
    });
    const Flight flight{chances_[1],
                        chances_[2],
                        agents_.best_at.at(best_agent()),
                        options.first_inertia - k * slowing,
                        options.cognitive,
                        options.social};
    thread_pool.for_all_particles([&](ParticleRange block) { fly(task, flight, block, agents_); });
    search(task, radius);
    radius *= 0.5;
    if (task.wants_agreement && agreement() >= options.target_agreement) break;
  }
  for (std::size_t i = 0; i < particles_; ++i) n.set(i, agents_.best_n.at(i));
}

/// Each one's best neighbour, as they were before anyone moved.
void Swarm::find_partners(ParticleRange range) {
  if (lattice_.cells() < 2) return;
  for (std::size_t i = range.first; i < std::min(range.last, lattice_.cells()); ++i) {
    const std::size_t m =
        *std::ranges::max_element(neighbours_[i], {}, [&](std::size_t k) { return agents_.value[k]; });
    partner_values_[i] = agents_.value[m];
    partners_.set(i, agents_.at.at(m));
  }
}

std::size_t Swarm::best_agent() const {
  const auto& value = agents_.best_value;
  return static_cast<std::size_t>(
      std::max_element(value.begin(), value.begin() + static_cast<std::ptrdiff_t>(particles_)) -
      value.begin());
}

double Swarm::agreement() const {
  double sum = 0.0;
  for (std::size_t i = 0; i < particles_; ++i) sum += agents_.best_agreement[i];
  return sum / static_cast<double>(particles_);
}

/// The best looks at the 26 neighbours on a lattice of the given width, and goes to the best of them.
void Swarm::search(const SwarmTask& task, double radius) {
  const std::size_t i = best_agent();
  search_around(task, {i, agents_.best_n.at(i), radius, cells_}, {0, padded(kCells)}, found_);
  const auto best = static_cast<std::size_t>(
      std::max_element(found_.value.begin(), found_.value.begin() + kCells) - found_.value.begin());
  if (found_.value[best] <= agents_.best_value[i]) return;
  agents_.n.set(i, found_.n.at(best));
  agents_.best_n.set(i, found_.n.at(best));
  agents_.value[i] = agents_.best_value[i] = found_.value[best];
  agents_.best_agreement[i] = found_.agreement[best];
  for (BodyColumns* bodies : {&agents_.at, &agents_.best_at}) bodies->set(i, found_.at.at(best));
}

}  // namespace trundle::slam
