#pragma once

#include <array>
#include <cstddef>
#include <optional>

#include "trundle/statistics/running_quantile.hpp"

namespace trundle::recording {

/// What a counter did over a step besides counting.
enum class CounterEvent {
  none,
  wrap,   ///< passed the end of its range
  reset,  ///< started again near zero
  jump,   ///< is elsewhere without having driven there
};

/// From one count to the next.
struct CounterStep {
  double start_s = 0.0;
  double end_s = 0.0;
  double travel = 0.0;  ///< in the counter's unit
  CounterEvent event = CounterEvent::none;

  /// False where the travel is a guess.
  [[nodiscard]] bool is_measured() const {
    return event == CounterEvent::none || event == CounterEvent::wrap;
  }
  [[nodiscard]] double duration_s() const { return end_s - start_s; }
  [[nodiscard]] double speed() const { return travel / duration_s(); }
};

/// One wheel's cumulative reading (counts, metres or radians), reading by reading: wraps are undone, and what
/// is no travel is told from what is. A wheel that reaches a speed v covers about v·Δt in a step; five times
/// that and landing near zero is a reset, twenty times that a jump. A few counts are always allowed, and so
/// is what the step before or after bears out, wherefore a suspicious step waits for the next one.
class Counter {
 public:
  struct Options {
    int bits = 0;              ///< it wraps at 2^bits; 0: never
    double usual_speed = 0.0;  ///< [units/s] a wheel may reach, until enough of its motion was seen
  };
  explicit Counter(const Options& options);

  /// The steps that a reading decides, in order: none, one, or two. Times must grow; of the first reading the
  /// step has no length.
  struct Steps {
    std::array<CounterStep, 2> step{};
    std::size_t count = 0;

    [[nodiscard]] const CounterStep* begin() const { return step.data(); }
    [[nodiscard]] const CounterStep* end() const { return step.data() + count; }
    void add(const CounterStep& decided) { step[count++] = decided; }
  };
  [[nodiscard]] Steps add(double time_s, double count, double longest_step_s);
  /// What waits, where nothing will come that could bear it out.
  [[nodiscard]] Steps decide(double longest_step_s);

  /// Time of the last reading; nothing before the first.
  [[nodiscard]] const std::optional<double>& time_s() const { return time_s_; }
  [[nodiscard]] bool waits() const { return waiting_.has_value(); }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.time_s_, self.count_, self.speed_before_, self.waiting_, self.top_speed_, self.resolution_);
  }

 private:
  /// A step that no usual speed explains.
  struct Suspicion {
    CounterStep step;
    CounterEvent looks_like = CounterEvent::none;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.step.start_s, self.step.end_s, self.step.travel, self.step.event, self.looks_like);
    }
  };

  CounterStep step_to(double time_s, double count) const;
  CounterEvent suspicion_of(const CounterStep& step, double count) const;
  double top_speed() const;
  CounterStep decided(const Suspicion& suspicion, const CounterStep* next, bool next_is_sound,
                      double longest_step_s) const;
  CounterStep learned(const CounterStep& step);

  double range_;  ///< 0: never wraps
  double usual_speed_;
  std::optional<double> time_s_;
  double count_ = 0.0;
  std::optional<double> speed_before_;  ///< of the last step that was measured, if that is the last one
  std::optional<Suspicion> waiting_;
  RunningQuantile top_speed_;  ///< of the steps that moved
  double resolution_ = 0.0;    ///< the smallest travel that was read: 1 for counts; 0: none yet
};

}  // namespace trundle::recording
