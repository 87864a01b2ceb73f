#include "trundle/simulation/command.hpp"

#include <algorithm>
#include <cmath>

namespace trundle::simulation {
namespace {

/// Steering takes time; whole intervals of it where the path is made of such, one at least.
double ramp_of(const Scenario& scenario) {
  if (!is_steered(scenario.nominal.chassis)) return 0.0;
  const double intervals = std::max(1.0, scenario.steered.ramp_s * scenario.encoders.rate_hz);
  return (scenario.whole_intervals ? std::ceil(intervals - kSameTime_s) : intervals) /
         scenario.encoders.rate_hz;
}

}  // namespace

double snapped(double time_s, double rate_hz) {
  const double sample = std::round(time_s * rate_hz) / rate_hz;
  return std::abs(time_s - sample) < kSameTime_s ? sample : time_s;
}

Command::Command(const Scenario& scenario) : rate_hz_(scenario.encoders.rate_hz), ramp_s_(ramp_of(scenario)) {
  const Path path = scenario.whole_intervals ? in_whole_intervals(scenario.path, rate_hz_) : scenario.path;
  double clock = 0.0;
  for (const Segment& segment : path) {
    const double start = snapped(clock, rate_hz_);
    clock += segment.duration_s;
    line_.push_back({start, snapped(clock, rate_hz_), segment.motion});
  }
  const double start = line_.empty() ? 0.0 : line_.back().end_s;
  line_.push_back({start, std::ceil((start + ramp_s_) * rate_hz_ - kSameTime_s) / rate_hz_, {}});
}

std::vector<double> Command::corners() const {
  std::vector<double> corners;
  for (const TimedSegment& segment : line_) {
    corners.push_back(segment.end_s);
    const double ramped_s = snapped(segment.end_s + ramp_s_, rate_hz_);
    if (ramped_s < end_s()) corners.push_back(ramped_s);
  }
  return corners;
}

std::vector<Command::TimedSegment>::const_iterator Command::segment_until(double time_s) const {
  return std::ranges::lower_bound(line_, time_s - kSameTime_s, {}, &TimedSegment::end_s);
}

Twist2 Command::over(const TimeSpan& interval) const {
  if (ramp_s_ > 0.0) {
    const Twist2 per_s = velocity(interval.start_s + 0.5 * interval.duration_s);
    return Twist2::from(interval.duration_s * per_s.vector());
  }
  const TimedSegment& segment = *segment_until(interval.end_s());
  const double share = interval.duration_s / (segment.end_s - segment.start_s);
  return Twist2::from(share * segment.motion.vector());
}

/// The mean over the time of a ramp before it.
Twist2 Command::velocity(double time_s) const {
  const double from_s = time_s - ramp_s_;
  Vector3 way = Vector3::Zero();
  for (auto segment = segment_until(from_s); segment != line_.end() && segment->start_s < time_s; ++segment) {
    const double overlap_s = std::min(time_s, segment->end_s) - std::max(from_s, segment->start_s);
    if (overlap_s > 0.0) way += overlap_s / (segment->end_s - segment->start_s) * segment->motion.vector();
  }
  return Twist2::from(way / ramp_s_);
}

}  // namespace trundle::simulation
