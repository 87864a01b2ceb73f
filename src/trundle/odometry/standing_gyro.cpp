#include "trundle/odometry/standing_gyro.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "trundle/chassis/rows.hpp"

namespace trundle::odometry {
namespace {

/// Any mean passes; the scatter is judged all the same.
constexpr GyroBias kAnyBias{0.0, std::numeric_limits<double>::infinity()};
/// A rest is evidence of the bias from the second block on; so is what passes for one.
constexpr double kFewestBlocks = 2.0;

/// The smallest turn that moves the counter of some wheel beyond the range over which it may toggle, wherever
/// in that range it began: twice the range over the wheel's lever.
double smallest_seen_turn(const Chassis& chassis, const RestOptions& options) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const Wheel& wheel : chassis.wheels())
    smallest = std::min(smallest, 2.0 * jitter_of(wheel, options) / std::abs(rolling_row(wheel).z()));
  return smallest;
}

}  // namespace

StandingGyro::StandingGyro(const Chassis& chassis, const RestOptions& options)
    : detector_(chassis, options),
      options_(options),
      unseen_turn_rad_(chassis.wheel_count > 0 ? smallest_seen_turn(chassis, options) : 0.0) {}

void StandingGyro::watch(const Increment& increment, bool at_rest, const GyroBias& bias) {
  const bool still = detector_.continues(state_, increment, kAnyBias);
  if (still)
    detector_.add(state_, increment);
  else
    RestDetector::leave(state_);
  detector_.follow_counts(state_, increment);
  if (!still) return close();
  if (at_rest) return close();
  if (present_.duration_s == 0.0) present_.start_s = increment.time_s - increment.duration_s;
  present_.duration_s += increment.duration_s;
  present_.gyro_rad += increment.gyro_rad;
  present_.bias = bias;
}

std::vector<SteadyReading> StandingGyro::found() {
  close();
  return found_;
}

void StandingGyro::close() {
  if (present_.duration_s >= kFewestBlocks * options_.block_s && beyond_bias()) found_.push_back(present_);
  present_ = {};
}

/// Beyond what bias and noise explain there must be left so much that the wheels should have seen it: a robot
/// may turn so slowly that they do not.
bool StandingGyro::beyond_bias() const {
  const double T = present_.duration_s;
  const double explained =
      options_.sigmas * std::sqrt(present_.bias.variance * T * T + detector_.gyro_density() * T);
  return std::abs(present_.gyro_rad - present_.bias.rad_s * T) > explained + unseen_turn_rad_;
}

}  // namespace trundle::odometry
