#include "trundle/slam/particles/pieces.hpp"

#include <algorithm>

#include <tbb/parallel_for.h>

namespace trundle {

void run_pieces(std::size_t particles, std::size_t threads, void (*step)(void*, ParticleRange),
                void* context) {
  constexpr std::size_t kLeast = 64;  // particles for which starting a thread is worth it
  const std::size_t all = padded(particles);
  const std::size_t pieces = std::clamp(all / kLeast, std::size_t{1}, std::max(threads, std::size_t{1}));
  if (pieces == 1) return step(context, {0, all});
  const std::size_t length = padded((all + pieces - 1) / pieces);
  tbb::parallel_for(
      std::size_t{0}, pieces,
      [&](std::size_t k) {
        step(context, {std::min(k * length, all), std::min((k + 1) * length, all)});
      },
      tbb::static_partitioner());
}

}  // namespace trundle
