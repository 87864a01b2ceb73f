#include "trundle/odometry/rolling.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "trundle/geometry/squared.hpp"

namespace trundle::odometry {
namespace {

static_assert(std::is_trivially_copyable_v<Rolling>);

/// Below it a robot is weighed as one that is about to start.
constexpr double kSlowest_m_s = 0.01;
/// Over 4 k² roll noise drives a wheel the wrong way once in 3000 times: exp(−2 · 4 k²/k²).
constexpr double kNoiseLengths = 4.0;
/// What goes under the name of roll noise in a robot that scrubs does not move its counters to and fro:
/// beyond this length travel is travel, however noisy.
constexpr double kLongestNoise_m = 0.01;
/// A counter at an edge toggles by one tick.
constexpr double kTicks = 2.0;

/// [m]; of a turn in radians likewise. The next power of two: who looks for the noise by what variances it
/// makes would else see them leap, where a little more of it makes a stretch too short to be sure.
double noise_length(double per_sqrt_m) {
  if (!(per_sqrt_m > 0.0)) return 0.0;
  return std::min(std::exp2(std::ceil(std::log2(kNoiseLengths * squared(per_sqrt_m)))), kLongestNoise_m);
}

}  // namespace

RollingGauge::RollingGauge(const Chassis& chassis) {
  const ChassisNoise& noise = chassis.noise;
  double grain_m = 0.0;
  if (chassis.wheel_count == 0) {  // forward and turn; the turn's noise comes of both
    inputs_ = 2;
    const double forward = std::abs(chassis.velocity.forward_scale);
    const double yaw = std::abs(chassis.velocity.yaw_scale);
    grain_m = noise_length(noise.wheel_per_sqrt_m);
    grain_ = {grain_m / forward, noise_length(noise.turn_per_sqrt_rad) / yaw};
    const double by_travel = squared(noise.turn_per_sqrt_m);
    const double by_turn = squared(noise.turn_per_sqrt_rad);
    const double both = by_travel + by_turn;
    metres_ = both > 0.0 ? Rolled{forward * by_travel / both, yaw * by_turn / both} : Rolled{forward, 0.0};
  }
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    const Wheel& wheel = chassis.wheels()[i];
    const double per_turn_m = kPi * std::abs(wheel.diameter_m);
    const double ticks = std::abs(wheel.ticks_per_revolution);
    grain_[i] = noise_length(wheel_noise(chassis, i)) / per_turn_m + (ticks > 0.0 ? kTicks / ticks : 0.0);
    metres_[i] = per_turn_m / chassis.wheel_count;
    grain_m = std::max(grain_m, grain_[i] * per_turn_m);
    ++inputs_;
  }
  slowest_m_s_ =
      std::max(kSlowest_m_s, 2.0 * grain_m / kSpeedTime_s);  // slower, and single grains would show
}

std::size_t RollingGauge::octave_of(double speed_m_s) const {
  if (!(speed_m_s > slowest_m_s_)) return 0;
  const double octave = std::round(std::log2(speed_m_s / slowest_m_s_));
  return static_cast<std::size_t>(std::min(octave, static_cast<double>(kOctaves - 1)));
}

}  // namespace trundle::odometry
