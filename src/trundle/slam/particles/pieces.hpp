#pragma once

#include "trundle/slam/particles/columns.hpp"

namespace trundle {

/// All particles in as many pieces as there are threads, each run on one: step(context, piece).
void run_pieces(std::size_t particles, std::size_t threads, void (*step)(void*, ParticleRange),
                void* context);

/// body(piece) for pieces that together are all particles, padding included. What a body does to a particle
/// must not depend on others: then the number of threads changes nothing.
template <class Body>
void for_all_particles(std::size_t particles, std::size_t threads, Body&& body) {
  run_pieces(
      particles, threads,
      [](void* context, ParticleRange piece) {
        (*static_cast<std::remove_reference_t<Body>*>(context))(piece);
      },
      &body);
}

}  // namespace trundle
