#include "trundle/chassis/tyre_growth.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/chassis/parameter.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::chassis {
namespace {

/// How far a wheel rolls until its speed is known to be another one [m], and so many counts: the rounding of
/// twenty makes the square of a speed 1 % too large where an interval has 0.3 of them.
constexpr double kSpeedMemory_m = 0.002;
constexpr double kSpeedMemoryTicks = 20.0;
/// And how long it takes at most [s], for it may have stood still.
constexpr double kSpeedMemory_s = 0.5;
/// No wheel turns faster [1/s]: what a counter that leaps seems to do.
constexpr double kFastest = 1000.0;

/// The x of x (1 + growth x²) = ground; where growth is negative and none is, that of the largest ground.
/// Both are the solution of a cubic in closed form.
double speed_moving(double ground, double growth) {
  if (growth == 0.0) return ground;
  const double scale = 2.0 / std::sqrt(3.0 * std::abs(growth));
  const double third = 3.0 * ground / scale;
  return scale * (growth > 0.0 ? std::sinh(std::asinh(third) / 3.0)
                               : std::sin(std::asin(std::clamp(third, -1.0, 1.0)) / 3.0));
}

}  // namespace

bool depends_on_speed(const Robot& robot) {
  if (robot.chassis.wheel_count == 0) return false;
  if (grows(robot.chassis)) return true;
  const std::string name = name_of({ParameterKind::tyre_growth, -1}, robot);
  return robot.calibration &&
         std::ranges::count(robot.calibration->parameters, name, &CalibratedParameter::name) > 0;
}

std::array<double, kMaxWheels> with_growth(const Chassis& chassis,
                                           const std::array<double, kMaxWheels>& turned, double duration_s) {
  std::array<double, kMaxWheels> wheels = turned;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    wheels[i] = duration_s * speed_moving(turned[i] / duration_s, growth_of(chassis, i));
  return wheels;
}

std::array<double, kMaxWheels> without_growth(const Chassis& chassis,
                                              const std::array<double, kMaxWheels>& turned,
                                              double duration_s) {
  std::array<double, kMaxWheels> ground = turned;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    ground[i] *= 1.0 + growth_of(chassis, i) * squared(turned[i] / duration_s);
  return ground;
}

SpeedGauge::SpeedGauge(const Chassis& chassis) : wheels_(chassis.wheels().size()) {
  for (std::size_t i = 0; i < wheels_; ++i)
    memory_[i] = revolutions_of(chassis.wheels()[i], kSpeedMemory_m, kSpeedMemoryTicks);
}

// In the middle of an interval, as ScrubGauge: what is rounded off at its end is as much in the speed as it
// is not.
void SpeedGauge::add(SpeedState& state, Increment& increment) const {
  const double half_s = 0.5 * increment.duration_s;
  for (std::size_t i = 0; i < wheels_; ++i) {
    const double half = 0.5 * increment.turned[i];
    const double kept =
        std::min(memory_[i] / (memory_[i] + std::abs(half)), kSpeedMemory_s / (kSpeedMemory_s + half_s));
    const auto go_half = [&] {
      state.turned[i] = kept * state.turned[i] + half;
      state.duration_s[i] = kept * state.duration_s[i] + half_s;
    };
    go_half();
    const double speed = state.duration_s[i] > 0.0 ? state.turned[i] / state.duration_s[i] : 0.0;
    increment.speed_turned[i] = increment.turned[i] * squared(std::clamp(speed, -kFastest, kFastest));
    go_half();
  }
}

}  // namespace trundle::chassis
