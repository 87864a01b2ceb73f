#pragma once

#include <memory>
#include <type_traits>

#include "trundle/slam/fastslam/columns.hpp"

namespace trundle::slam {

/// Threads that share the particles of one filter. What they do in a step takes less time than waking one of
/// them, so they stay awake for a moment after each call; and a block whose thread is late, because the
/// machine has other things to do, is done by one that is there: with a std::barrier, which waits for it, a
/// step of 0.1 ms took 5 ms on a busy machine. A copy has threads of its own.
class ThreadPool {
 public:
  ThreadPool(std::size_t threads, std::size_t particles);
  ThreadPool(const ThreadPool& other) : ThreadPool(other.threads_, other.particles_) {}
  ThreadPool(ThreadPool&& other) noexcept;
  ThreadPool& operator=(ThreadPool other) noexcept;
  ~ThreadPool();

  /// body(block) for blocks that together are all particles, padding included. What a body does to a particle
  /// must not depend on others: then the number of threads changes nothing.
  template <class Body>
  void for_all_particles(Body&& body) {
    run([](void* context,
           ParticleRange block) { (*static_cast<std::remove_reference_t<Body>*>(context))(block); },
        &body);
  }

 private:
  using Step = void (*)(void* context, ParticleRange block);
  class Workers;

  void run(Step step, void* context);

  std::size_t threads_;
  std::size_t particles_;
  std::unique_ptr<Workers> workers_;  ///< none before the first call, nor where nobody is to help
};

}  // namespace trundle::slam
