#include "trundle/odometry/rest.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

namespace trundle::odometry {

static_assert(std::is_trivially_copyable_v<RestState> && std::is_trivially_copyable_v<RestDetector>);
static_assert(sizeof(RestState) % sizeof(double) == 0);

namespace {

/// Counts are whole but for the rounding of their sums.
constexpr double kSurelyCounted = 0.5;
/// One count against the last may be a counter that toggles, two are not.
constexpr double kSurelyMoved = 1.5;
/// A wheel without ticks counts where an interval exceeds its jitter: its count is that over kSurelyCounted.
constexpr double kCountsOfJitter = 1.0 / kSurelyCounted;

}  // namespace

double jitter_of(const Wheel& wheel, const RestOptions& options) {
  return wheel.ticks_per_revolution == 0.0 ? options.jitter_m : options.jitter_ticks * metres_per_tick(wheel);
}

RestDetector::RestDetector(const Chassis& chassis, const RestOptions& options)
    : options_(options),
      wheels_(chassis.wheel_count > 0 ? chassis.wheels().size() : 2),
      has_gyro_(chassis.gyro.has_value()) {
  if (chassis.wheel_count == 0) {
    jitter_ = {options.jitter_m, 0.0};  // a turn rate at rest is zero
    count_[0] = kCountsOfJitter * options.jitter_m;
  }
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    const Wheel& wheel = chassis.wheels()[i];
    jitter_[i] = jitter_of(wheel, options) / (kPi * wheel.diameter_m);
    count_[i] = wheel.ticks_per_revolution == 0.0 ? kCountsOfJitter * jitter_[i]
                                                  : 1.0 / std::abs(wheel.ticks_per_revolution);
  }
  if (!has_gyro_) return;
  const double density = options.gyro_noise_factor * chassis.gyro->noise_rad_s_sqrt_hz;
  gyro_density_ = density * density;
}

bool RestDetector::continues(const RestState& state, const Increment& increment, const GyroBias& bias) const {
  if (increment.duration_s <= 0.0 || !wheels_rest(state, increment) || !wheels_stand(state, increment))
    return false;
  const RestBlock block = with(state.block, increment);
  if (has_gyro_ && (!increment.has_gyro || !gyro_rests(increment.gyro_rad, increment.duration_s, bias) ||
                    !gyro_rests(block.gyro_rad, block.duration_s, bias)))
    return false;
  if (block.shaking_squares > options_.shaking_m_s2 * options_.shaking_m_s2 * block.shaking_intervals)
    return false;
  return !has_gyro_ || !complete(block) || scatter_rests(block);
}

std::optional<GyroEvidence> RestDetector::add(RestState& state, const Increment& increment) const {
  for (std::size_t i = 0; i < wheels_; ++i) {
    state.turned[i] += increment.turned[i];
    state.low[i] = std::min(state.low[i], state.turned[i]);
    state.high[i] = std::max(state.high[i], state.turned[i]);
  }
  state.steering_rad = increment.steering_rad;
  state.block = with(state.block, increment);
  if (state.phase == RestPhase::moving) state.phase = RestPhase::settling;
  if (!complete(state.block)) return std::nullopt;
  const RestBlock passed = std::exchange(state.passed, std::exchange(state.block, {}));
  state.phase = RestPhase::resting;
  if (!has_gyro_ || passed.duration_s == 0.0) return std::nullopt;
  return GyroEvidence{passed.gyro_rad, passed.duration_s};
}

Increment RestDetector::withheld(const RestState& state, double time_s) {
  Increment increment;
  increment.time_s = time_s;
  increment.duration_s = state.block.duration_s;
  increment.turned = state.turned;
  increment.steering_rad = state.steering_rad;
  increment.gyro_rad = state.block.gyro_rad;
  increment.has_gyro = true;
  return increment;
}

std::optional<Increment> RestDetector::settled(RestState& state, double time_s) const {
  if (state.phase != RestPhase::resting || state.block.duration_s > 0.0) return std::nullopt;
  Increment increment;
  increment.time_s = time_s;
  increment.turned = state.turned;
  increment.steering_rad = state.steering_rad;
  increment.has_gyro = true;  // over no time, so neither bias nor noise
  for (std::size_t i = 0; i < wheels_; ++i) {
    state.low[i] -= state.turned[i];
    state.high[i] -= state.turned[i];
  }
  state.turned = {};
  return increment;
}

RestBlock RestDetector::with(const RestBlock& block, const Increment& increment) const {
  RestBlock sum = block;
  sum.duration_s += increment.duration_s;
  sum.intervals += 1.0;
  sum.gyro_rad += increment.gyro_rad;
  sum.gyro_squares += increment.gyro_rad * increment.gyro_rad / increment.duration_s;
  if (std::isnan(increment.shaking_m_s2)) return sum;
  sum.shaking_squares += increment.shaking_m_s2 * increment.shaking_m_s2;
  sum.shaking_intervals += 1.0;
  return sum;
}

/// Counters may toggle, but not creep: their range since the rest began is bounded.
bool RestDetector::wheels_rest(const RestState& state, const Increment& increment) const {
  for (std::size_t i = 0; i < wheels_; ++i) {
    const double turned = state.turned[i] + increment.turned[i];
    if (std::max(state.high[i], turned) - std::min(state.low[i], turned) > jitter_[i]) return false;
  }
  return true;
}

/// How often a wheel counted; 0 where it may have stood.
double RestDetector::counts_in(const Increment& increment, std::size_t wheel) const {
  const double turned = increment.turned[wheel];
  return std::abs(turned) > kSurelyCounted * count_[wheel] ? turned / count_[wheel] : 0.0;
}

/// docs/theory/gyro.md, eq. 3a: before the interval every wheel came to stand, and none goes on in it.
bool RestDetector::wheels_stand(const RestState& state, const Increment& increment) const {
  const auto cube = [](double x) { return x * x * x; };
  for (std::size_t i = 0; i < wheels_; ++i) {
    const LastCounts& last = state.last[i];
    if (last.counts * counts_in(increment, i) > 0.0) return false;
    const bool stood =
        last.since_s >= options_.longest_stop_s ||
        cube(last.since_s + last.within_s) <= (1.0 + std::abs(last.counts)) * cube(last.since_s);
    if (!stood) return false;
  }
  return true;
}

void RestDetector::follow_counts(RestState& state, const Increment& increment) const {
  for (std::size_t i = 0; i < wheels_; ++i) {
    LastCounts& last = state.last[i];
    const double counts = counts_in(increment, i);
    if (counts == 0.0) {
      last.since_s += increment.duration_s;
      continue;
    }
    const bool goes_on = last.counts * counts > 0.0;
    const bool may_toggle = !goes_on && std::abs(counts) < kSurelyMoved;
    last.within_s = may_toggle ? 0.0 : increment.duration_s + (goes_on ? last.since_s : 0.0);
    last.counts = counts;
    last.since_s = 0.0;
  }
}

void RestDetector::leave(RestState& state) {
  const std::array<LastCounts, kMaxWheels> last = state.last;
  state = {};
  state.last = last;
}

/// docs/theory/gyro.md, eq. 1
bool RestDetector::gyro_rests(double gyro_rad, double duration_s, const GyroBias& bias) const {
  const double turn = gyro_rad - bias.rad_s * duration_s;
  const double variance = bias.variance * duration_s * duration_s + gyro_density_ * duration_s;
  return turn * turn <= options_.sigmas * options_.sigmas * variance;
}

/// docs/theory/gyro.md, eq. 2
bool RestDetector::scatter_rests(const RestBlock& block) const {
  const double degrees = block.intervals - 1.0;
  const double squares = block.gyro_squares - block.gyro_rad * block.gyro_rad / block.duration_s;
  return squares <= gyro_density_ * (degrees + options_.sigmas * std::sqrt(2.0 * degrees));
}

bool RestDetector::complete(const RestBlock& block) const {
  return block.duration_s >= options_.block_s && block.intervals >= options_.fewest_intervals;
}

}  // namespace trundle::odometry
