#include "trundle/slam/step_cutter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "trundle/recording/alignment/share_of.hpp"

namespace trundle::slam {
namespace {

/// Stamps closer than their own resolution (nanoseconds in every log) are one instant.
constexpr double kSameTime_s = 1e-9;

/// By how much the rate of a reading grows within its interval, in readings an interval: evenly accelerated
/// since the middle of the one before, but never so that it turns back.
double growth_of(double reading, double duration_s, double reading_before, double duration_before_s) {
  if (duration_before_s <= 0.0) return 0.0;
  const double acceleration =
      (reading / duration_s - reading_before / duration_before_s) / (0.5 * (duration_s + duration_before_s));
  const double most = 2.0 * std::abs(reading);
  return std::clamp(acceleration * duration_s * duration_s, -most, most);
}

/// What was read between two shares of an interval's time: docs/theory/motion-and-sensor.md, the steps of a
/// recording.
Increment part_of(const Increment& whole, const Increment& before, double first, double last) {
  const double share = last - first;
  const double from_middle = 0.5 * (first + last) - 0.5;
  const auto read = [&](double reading, double reading_before, double duration_before_s) {
    const double growth = growth_of(reading, whole.duration_s, reading_before, duration_before_s);
    return share * (reading + from_middle * growth);
  };
  Increment part = share_of(whole, share);
  part.gyro_rad = read(whole.gyro_rad, before.gyro_rad, before.has_gyro ? before.duration_s : 0.0);
  for (std::size_t i = 0; i < part.turned.size(); ++i)
    part.turned[i] = read(whole.turned[i], before.turned[i], before.duration_s);
  return part;
}

/// Evenly. How many go.
std::size_t thin_out(std::vector<std::size_t>& seen) {
  const std::size_t all = seen.size();
  if (all <= kMostSightingsAtOnce) return 0;
  for (std::size_t i = 0; i < kMostSightingsAtOnce; ++i) seen[i] = seen[i * all / kMostSightingsAtOnce];
  seen.resize(kMostSightingsAtOnce);
  return all - kMostSightingsAtOnce;
}

}  // namespace

LandmarkId StepCutter::Names::id_of(const std::string& name) {
  const auto [at, is_new] = ids.try_emplace(name, static_cast<LandmarkId>(list.size()));
  if (is_new) list.push_back(name);
  return at->second;
}

StepCutter::StepCutter(const Robot& robot, const SlamInputOptions& options)
    : options_(options),
      sensor_(*robot.landmark_sensor),
      systematic_(systematic_errors_of(robot, options.shares, options.lengths)),
      motion_(robot, options, systematic_) {
  for (const std::string& name : options.names) names_.id_of(name);
}

void StepCutter::add_sighting(const Sighting& sighting) {
  waiting_.push_back({sighting.time_s, sighting.landmark, sighting.range_m, sighting.bearing_rad});
}

void StepCutter::start(double time_s) {
  now_s_ = last_step_s_ = time_s;
  const auto inside =
      std::ranges::find_if(waiting_, [&](const Waiting& sighting) { return !(sighting.time_s < time_s); });
  outside_ += static_cast<std::size_t>(inside - waiting_.begin());
  forget_first(static_cast<std::size_t>(inside - waiting_.begin()));
  bool stops_here = false;
  for (; stop_until(time_s); ++next_stop_) stops_here = options_.also_at_s[next_stop_] == time_s;
  if (sighting_until(time_s))
    finish_sighting_step();
  else if (stops_here)
    finish_step();
}

void StepCutter::advance(const Increment& increment, bool bridged) {
  const double end_s = increment.time_s;
  const double start_s = end_s - increment.duration_s;
  const auto part_until = [&](double time_s) {
    return part_of(increment, bridged ? Increment{} : before_, (now_s_ - start_s) / (end_s - start_s),
                   (time_s - start_s) / (end_s - start_s));
  };
  while (sighting_until(end_s) || stop_until(end_s)) {
    double stop_s = end_s;
    if (sighting_until(end_s)) stop_s = waiting_.front().time_s;
    if (stop_until(stop_s)) stop_s = options_.also_at_s[next_stop_];
    move_to(stop_s, part_until(stop_s), bridged);
    if (sighting_until(now_s_))
      finish_sighting_step();
    else if (now_s_ > last_step_s_)
      finish_step();
    while (stop_until(now_s_)) ++next_stop_;
  }
  if (end_s > now_s_) {
    move_to(end_s, part_until(end_s), bridged);
    if (end_s - last_step_s_ >= options_.longest_step_s - kSameTime_s) finish_step();
  }
  before_ = bridged ? Increment{} : increment;
}

void StepCutter::finish() {
  if (now_s_ > last_step_s_) finish_step();
  outside_ += waiting_.size();
  forget_first(waiting_.size());
}

SlamInput StepCutter::take() {
  return std::exchange(input_, {});
}

std::vector<Finding> StepCutter::findings() const {
  std::vector<Finding> findings;
  const auto note = [&](std::size_t count, FindingCode code, const Payload& payload = {}) {
    if (count > 0) findings.push_back({Severity::note, code, "sightings", count, {}, payload});
  };
  note(outside_, FindingCode::sighting_without_odometry);
  note(repeated_, FindingCode::repeated_sighting);
  note(crowded_, FindingCode::crowded_instant, payload::Amount{static_cast<double>(kMostSightingsAtOnce)});
  return findings;
}

bool StepCutter::sighting_until(double time_s) const {
  return !waiting_.empty() && waiting_.front().time_s <= time_s;
}

bool StepCutter::stop_until(double time_s) const {
  return next_stop_ < options_.also_at_s.size() && options_.also_at_s[next_stop_] <= time_s;
}

void StepCutter::move_to(double time_s, const Increment& part, bool bridged) {
  if (time_s > now_s_) motion_.add(part, bridged);
  now_s_ = time_s;
}

void StepCutter::finish_step() {
  motion_.finish_step(now_s_, input_);
  last_step_s_ = now_s_;
}

/// All that is seen now, if anything is; what is recorded twice counts once.
void StepCutter::finish_sighting_step() {
  if (!sighting_until(now_s_)) return;
  finish_step();
  std::vector<std::size_t> seen;
  std::size_t next = 0;
  for (; next < waiting_.size() && waiting_[next].time_s <= now_s_; ++next) {
    const auto end = waiting_.begin() + static_cast<std::ptrdiff_t>(next);
    if (std::find(waiting_.begin(), end, waiting_[next]) != end)
      ++repeated_;
    else
      seen.push_back(next);
  }
  crowded_ += thin_out(seen);
  for (const std::size_t i : seen) {
    input_.steps.back().observations.push_back(observed(waiting_[i]));
    input_.sighting_numbers.push_back(first_ + i);
  }
  forget_first(next);
}

Observation StepCutter::observed(const Waiting& sighting) {
  const bool has_name = !options_.hide_ids && !sighting.landmark.empty();
  return observation_of(sensor_, has_name ? names_.id_of(sighting.landmark) : kUnknownLandmark,
                        sighting.range_m, sighting.bearing_rad);
}

void StepCutter::forget_first(std::size_t count) {
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(count));
  first_ += count;
}

}  // namespace trundle::slam
