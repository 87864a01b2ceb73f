#pragma once

#include <csignal>
#include <functional>
#include <mutex>
#include <thread>

#include "trundle/namespaces.hpp"

namespace trundle::io {

/// While this lives, Ctrl-C and its like call `clean_up` before they end the program: those alone that would
/// end it, not what has a handler or is ignored.
class OnInterruption {
 public:
  explicit OnInterruption(std::function<void()> clean_up);
  ~OnInterruption();
  OnInterruption(const OnInterruption&) = delete;
  OnInterruption& operator=(const OnInterruption&) = delete;

  /// They wait for as long as it is held.
  std::unique_lock<std::mutex> hold() { return std::unique_lock(busy_); }

 private:
  void wait();

  std::function<void()> clean_up_;
  std::mutex busy_;
  bool is_over_ = false;  ///< guarded by busy_
  sigset_t signals_{};
  int wake_ = 0;  ///< one of them, for the waiting thread alone; 0: there is none
  sigset_t before_{};
  std::thread waiting_;
};

/// While this lives, long computations of its thread call `check` now and then, some times in a second at
/// least; what that throws ends them.
class InterruptionCheck {
 public:
  explicit InterruptionCheck(std::function<void()> check);
  ~InterruptionCheck();
  InterruptionCheck(const InterruptionCheck&) = delete;
  InterruptionCheck& operator=(const InterruptionCheck&) = delete;

 private:
  std::function<void()> check_;
  const std::function<void()>* before_;
};
/// What long computations call: as often as they like, for it costs next to nothing.
void check_interruption();

}  // namespace trundle::io
