#include "trundle/slam/fastslam/thread_pool.hpp"

#include <chrono>
#include <thread>

#include <gtest/gtest.h>

namespace trundle::slam {
namespace {

/// How often each particle's turn has come.
struct Turns {
  explicit Turns(std::size_t particles) : count(padded(particles), 0) {}

  void take(ThreadPool& thread_pool) {
    thread_pool.for_all_particles([&](ParticleRange block) {
      EXPECT_EQ(block.first % kParticleLanes, 0U);
      for (std::size_t i = block.first; i < block.last; ++i) ++count[i];
    });
    ++calls;
  }
  void expect_all_equal() const {
    for (const int turns : count) ASSERT_EQ(turns, calls);
  }

  std::vector<int> count;
  int calls = 0;
};

TEST(ThreadPool, EachParticleHasItsTurnOnceInEachCall) {
  for (const std::size_t threads : {1U, 2U, 3U, 8U})
    for (const std::size_t particles : {1U, 100U, 128U, 1000U, 5000U}) {
      ThreadPool thread_pool(threads, particles);
      Turns turns(particles);
      for (int call = 0; call < 300; ++call) {
        turns.take(thread_pool);
        turns.expect_all_equal();  // all is done when the call returns
      }
    }
}

TEST(ThreadPool, WorksAfterARest) {
  ThreadPool thread_pool(3, 1000);
  Turns turns(1000);
  for (int call = 0; call < 10; ++call) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // longer than they stay awake
    turns.take(thread_pool);
    turns.expect_all_equal();
  }
}

TEST(ThreadPool, CopiesHaveThreadsOfTheirOwn) {
  ThreadPool first(3, 1000);
  Turns by_first(1000);
  Turns by_second(1000);
  by_first.take(first);
  ThreadPool second = first;
  for (int call = 0; call < 50; ++call) {
    by_first.take(first);
    by_second.take(second);
  }
  second = first;
  by_second.take(second);
  first = std::move(second);
  by_first.take(first);
  by_first.expect_all_equal();
  by_second.expect_all_equal();
}

TEST(ThreadPool, NeedsNoCall) {
  const ThreadPool thread_pool(8, 1000);
}

}  // namespace
}  // namespace trundle::slam
