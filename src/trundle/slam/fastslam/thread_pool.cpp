#include "trundle/slam/fastslam/thread_pool.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

#include <hwy/cache_control.h>

namespace trundle::slam {
namespace {

// Particles of a block: 128 × 5 numbers × 4 bytes of each of ten landmarks in view are 26 kB, which stay in
// the nearest cache of 32 kB.
constexpr std::size_t kBlock = 128;
// How long a thread waits awake: longer than the pauses within a step (some 10 µs), shorter than one between
// steps (1 ms and more), in which it should sleep.
constexpr std::chrono::microseconds kAwake{200};

using Counter = std::atomic<std::uint32_t>;

/// Waits until it is another number: awake for a moment, then asleep.
std::uint32_t changed(const Counter& counter, std::uint32_t from) {
  const auto end = std::chrono::steady_clock::now() + kAwake;
  do {
    for (int k = 0; k < 64; ++k) {
      if (const std::uint32_t now = counter.load(std::memory_order_acquire); now != from) return now;
      hwy::Pause();
    }
  } while (std::chrono::steady_clock::now() < end);
  counter.wait(from, std::memory_order_acquire);
  return counter.load(std::memory_order_acquire);
}

}  // namespace

/// Those that help the caller. Calls are counted; a block is taken, and done, for a call: who comes too late
/// for one finds all its blocks taken, and has not looked at what was to be done.
class ThreadPool::Workers {
 public:
  Workers(std::size_t threads, std::size_t particles)
      : particles_(padded(particles)), blocks_((particles_ + kBlock - 1) / kBlock) {
    try {
      for (std::size_t k = 1; k < threads; ++k)
        threads_.emplace_back([this, begin = k * blocks_.size() / threads] { attend(begin); });
    } catch (const std::system_error&) {
      // There are no more to be had: those that are there, and the caller, take all blocks.
    }
  }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  ~Workers() {
    is_over_.store(true, std::memory_order_relaxed);
    calls_.fetch_add(1, std::memory_order_release);
    calls_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }

  void run(Step step, void* context) {
    step_ = step;
    context_ = context;
    const std::uint32_t call = calls_.fetch_add(1, std::memory_order_release) + 1;
    calls_.notify_all();
    take_blocks(0, call);
    for (const Block& block : blocks_)
      while (block.done.load(std::memory_order_acquire) != call) changed(block.done, call - 1);
  }

 private:
  struct alignas(64) Block {
    Counter taken = 0;  ///< call for which it was last taken
    Counter done = 0;
  };

  void attend(std::size_t begin) {
    for (std::uint32_t call = changed(calls_, 0); !is_over_.load(std::memory_order_relaxed);
         call = changed(calls_, call))
      take_blocks(begin, call);
  }

  /// One's own first: they are in one's cache.
  void take_blocks(std::size_t begin, std::uint32_t call) {
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      const std::size_t number = (begin + k) % blocks_.size();
      Block& block = blocks_[number];
      std::uint32_t before = call - 1;
      if (!block.taken.compare_exchange_strong(before, call, std::memory_order_acq_rel)) continue;
      step_(context_, {number * kBlock, std::min((number + 1) * kBlock, particles_)});
      block.done.store(call, std::memory_order_release);
      block.done.notify_one();
    }
  }

  std::size_t particles_;
  std::vector<Block> blocks_;
  Step step_ = nullptr;
  void* context_ = nullptr;
  alignas(64) Counter calls_ = 0;
  std::atomic<bool> is_over_ = false;
  std::vector<std::thread> threads_;
};

ThreadPool::ThreadPool(std::size_t threads, std::size_t particles)
    : threads_(
          std::clamp((particles + kBlock - 1) / kBlock, std::size_t{1}, std::max(threads, std::size_t{1}))),
      particles_(particles) {}

ThreadPool::ThreadPool(ThreadPool&& other) noexcept = default;
ThreadPool& ThreadPool::operator=(ThreadPool other) noexcept {
  threads_ = other.threads_;
  particles_ = other.particles_;
  workers_ = std::move(other.workers_);
  return *this;
}
ThreadPool::~ThreadPool() = default;

void ThreadPool::run(Step step, void* context) {
  if (threads_ == 1) {
    for (std::size_t first = 0; first < padded(particles_); first += kBlock)
      step(context, {first, std::min(first + kBlock, padded(particles_))});
    return;
  }
  if (!workers_) workers_ = std::make_unique<Workers>(threads_, particles_);
  workers_->run(step, context);
}

}  // namespace trundle::slam
