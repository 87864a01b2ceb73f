#include "trundle/recording/alignment/counter.hpp"

#include <cmath>

namespace trundle::recording {
namespace {

constexpr double kFaster = 0.02;       // share of the steps that are faster than what counts as the top speed
constexpr std::uint64_t kEnough = 50;  // steps: of which one is known from then on
// A suspicious step that its neighbour goes on with at so much of its speed is a wheel that drives: a burst.
constexpr double kSustained = 0.25;

bool bears_out(double neighbour_speed, const CounterStep& step) {
  return neighbour_speed / step.speed() >= kSustained;
}

}  // namespace

Counter::Counter(const Options& options)
    : range_(options.bits > 0 ? std::ldexp(1.0, options.bits) : 0.0),
      usual_speed_(options.usual_speed),
      top_speed_(kFaster) {}

Counter::Steps Counter::add(double time_s, double count, double longest_step_s) {
  Steps steps;
  if (!time_s_) {
    steps.add({time_s, time_s, 0.0, CounterEvent::none});
  } else {
    const CounterStep step = step_to(time_s, count);
    const CounterEvent looks_like = suspicion_of(step, count);
    if (waiting_)
      steps.add(learned(decided(*waiting_, &step, looks_like == CounterEvent::none, longest_step_s)));
    waiting_.reset();
    if (looks_like == CounterEvent::none || (speed_before_ && bears_out(*speed_before_, step)))
      steps.add(learned(step));
    else
      waiting_ = {step, looks_like};
  }
  time_s_ = time_s;
  count_ = count;
  return steps;
}

Counter::Steps Counter::decide(double longest_step_s) {
  Steps steps;
  if (waiting_) steps.add(learned(decided(*waiting_, nullptr, false, longest_step_s)));
  waiting_.reset();
  return steps;
}

/// The difference of the counts; of one that wraps, the representative nearest to zero.
CounterStep Counter::step_to(double time_s, double count) const {
  const double difference = count - count_;
  const double travel = range_ > 0.0 ? difference - range_ * std::round(difference / range_) : difference;
  return {*time_s_, time_s, travel, travel == difference ? CounterEvent::none : CounterEvent::wrap};
}

CounterEvent Counter::suspicion_of(const CounterStep& step, double count) const {
  const double plausible = top_speed() * step.duration_s();
  const double travel = std::abs(step.travel);
  const bool near_zero = std::abs(count) <= 2.0 * plausible + 3.0 * resolution_;
  if (near_zero && travel > 5.0 * plausible + 10.0 * resolution_) return CounterEvent::reset;
  if (travel > 20.0 * plausible + 100.0 * resolution_) return CounterEvent::jump;
  return CounterEvent::none;
}

double Counter::top_speed() const {
  return top_speed_.count() < kEnough ? std::max(usual_speed_, top_speed_.level()) : top_speed_.level();
}

/// What is not borne out is no travel: the wheel is taken to have gone on at the mean of the speeds around
/// it, and to have stood still across a gap.
CounterStep Counter::decided(const Suspicion& suspicion, const CounterStep* next, bool next_is_sound,
                             double longest_step_s) const {
  CounterStep step = suspicion.step;
  if (next != nullptr && bears_out(next->speed(), step)) return step;
  step.event = suspicion.looks_like;
  double sum = speed_before_.value_or(0.0);
  int speeds = speed_before_ ? 1 : 0;
  if (next != nullptr && next_is_sound) {
    sum += next->speed();
    ++speeds;
  }
  const bool is_gap = step.duration_s() > longest_step_s;
  step.travel = speeds == 0 || is_gap ? 0.0 : sum / speeds * step.duration_s();
  return step;
}

CounterStep Counter::learned(const CounterStep& step) {
  speed_before_.reset();
  if (!step.is_measured()) return step;
  speed_before_ = step.speed();
  if (step.travel == 0.0) return step;
  top_speed_.add(std::abs(step.speed()));
  resolution_ = resolution_ == 0.0 ? std::abs(step.travel) : std::min(resolution_, std::abs(step.travel));
  return step;
}

}  // namespace trundle::recording
