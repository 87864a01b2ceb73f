#include "trundle/io/interruption.hpp"

#include <array>
#include <system_error>
#include <utility>

#include <pthread.h>

#include "trundle/io/error.hpp"

namespace trundle::io {
namespace {

constexpr std::array kEnding = {SIGINT, SIGTERM, SIGHUP};

bool ends_program(int signal) {
  struct sigaction now {};
  return ::sigaction(signal, nullptr, &now) == 0 && now.sa_handler == SIG_DFL;
}

/// Signals are of a process, and who computes does not know who asked: the one thing here that is passed on
/// beside the arguments.
thread_local const std::function<void()>* check_of_thread = nullptr;

}  // namespace

InterruptionCheck::InterruptionCheck(std::function<void()> check)
    : check_(std::move(check)), before_(std::exchange(check_of_thread, &check_)) {}

InterruptionCheck::~InterruptionCheck() {
  check_of_thread = before_;
}

void check_interruption() {
  if (check_of_thread != nullptr) (*check_of_thread)();
}

OnInterruption::OnInterruption(std::function<void()> clean_up) : clean_up_(std::move(clean_up)) {
  sigemptyset(&signals_);
  for (const int signal : kEnding)
    if (ends_program(signal)) sigaddset(&signals_, wake_ = signal);
  pthread_sigmask(SIG_BLOCK, &signals_, &before_);  // threads that are made from now on inherit it
  try {
    if (wake_ != 0) waiting_ = std::thread([this] { wait(); });
  } catch (const std::system_error& error) {
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
    throw InputError("a second thread", error.code().message(), "a higher limit of threads or memory");
  }
}

OnInterruption::~OnInterruption() {
  if (waiting_.joinable()) {
    {
      const auto held = hold();
      is_over_ = true;
    }
    pthread_kill(waiting_.native_handle(), wake_);
    waiting_.join();
  }
  pthread_sigmask(SIG_SETMASK, &before_, nullptr);
}

void OnInterruption::wait() {
  int signal = 0;
  sigwait(&signals_, &signal);
  const auto held = hold();
  if (is_over_) return;
  clean_up_();
  pthread_sigmask(SIG_UNBLOCK, &signals_, nullptr);
  ::raise(signal);
}

}  // namespace trundle::io
