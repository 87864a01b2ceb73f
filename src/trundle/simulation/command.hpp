#pragma once

#include <vector>

#include "trundle/simulation/scenario.hpp"

namespace trundle::simulation {

/// Times closer than this are one.
inline constexpr double kSameTime_s = 1e-9;
/// The sampling time that is the same, or else the time as it is.
double snapped(double time_s, double rate_hz);

/// The scenario's path on the time line: what the robot is asked to do at any time.
/// docs/theory/simulation.md.
class Command {
 public:
  explicit Command(const Scenario& scenario);

  /// When the last sample is taken, at rest.
  double end_s() const { return line_.back().end_s; }
  /// Where segments meet, and where the ramp that begins there ends.
  std::vector<double> corners() const;
  /// Twist over an interval without a corner inside.
  Twist2 over(const TimeSpan& interval) const;
  /// Per second, of a path that is ramped: continuous, and exactly zero where the robot rests.
  Twist2 velocity(double time_s) const;

 private:
  /// Each ends where the next begins; the last one is rest.
  struct TimedSegment {
    double start_s = 0.0;
    double end_s = 0.0;
    Twist2 motion;
  };
  /// The first one that ends at that time or later.
  std::vector<TimedSegment>::const_iterator segment_until(double time_s) const;

  double rate_hz_;
  double ramp_s_ = 0.0;  ///< 0: velocities jump
  std::vector<TimedSegment> line_;
};

}  // namespace trundle::simulation
