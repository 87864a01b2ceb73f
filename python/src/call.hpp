/// A long call: other threads of Python run meanwhile, and Ctrl-C ends it.
#pragma once

#include <chrono>
#include <ctime>

#include <pybind11/pybind11.h>

#include "trundle/io/interruption.hpp"

namespace trundle::python {

namespace py = pybind11;

/// No std::exception: whoever goes on after an error does not go on after this.
struct Interrupted {};

/// Throws what Python raises on a signal that came, if it did; looks some times in a second.
class SignalCheck {
 public:
  void operator()() {
    const Clock::time_point now = Clock::now();
    if (now < next_) return;
    next_ = now + kBetweenLooks;
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw Interrupted{};
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kBetweenLooks{50};

  Clock::time_point next_ = Clock::now() + kBetweenLooks;
};

/// What `compute` returns, computed without the GIL.
template <class Compute>
auto without_gil(const Compute& compute) {
  try {
    const py::gil_scoped_release released;
    const io::InterruptionCheck check{SignalCheck()};
    return compute();
  } catch (const Interrupted&) {
    throw py::error_already_set();  // what PyErr_CheckSignals has set
  }
}

/// Processor time of this thread [s].
inline double thread_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// What the library has taken of it. What a call takes besides is what Python adds:
/// tests/python/test_speed.py.
inline thread_local double library_s = 0.0;

/// What the library answers, without the GIL: `answer` calls it, and copies or converts nothing itself.
template <class Answer>
auto by_library(const Answer& answer) {
  struct Counted {
    double start = thread_s();
    ~Counted() { library_s += thread_s() - start; }
  };
  return without_gil([&] {
    const Counted counted;
    return answer();
  });
}

}  // namespace trundle::python
