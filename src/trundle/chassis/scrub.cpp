#include "trundle/chassis/scrub.hpp"

#include <algorithm>
#include <cmath>

#include "trundle/chassis/detail/parameter_parts.hpp"
#include "trundle/geometry/squared.hpp"

namespace trundle::chassis {
namespace {

/// How far the wheels of a side roll until a turn is known to be another one [m]: a hundredth of a turn on
/// the spot by 90° of a robot 0.25 m wide, which a turn then seems less sharp. Over it readings are right to
/// 1/7 at a noise of 0.01 m/√m, which makes a straight drive as sharp as 1/(2 · 7²).
constexpr double kMemory_m = 0.002;
/// Counts for which the same is true: the rounding of ten moves eq. 1 of a straight drive by 1/(24 · 10²).
constexpr double kMemoryTicks = 10.0;

/// Shares of each skid wheel in the mean turn of its side.
struct Means {
  std::array<double, kMaxWheels> left{};
  std::array<double, kMaxWheels> right{};
};

Means means_of(const Chassis& chassis) {
  Means means;
  const std::array<double, kMaxWheels> side = scrub_sides(chassis);
  const auto lefts = static_cast<double>(std::ranges::count(side, -1.0));
  const auto rights = static_cast<double>(std::ranges::count(side, 1.0));
  for (std::size_t i = 0; i < side.size(); ++i) {
    if (side[i] < 0.0) means.left[i] = 1.0 / lefts;
    if (side[i] > 0.0) means.right[i] = 1.0 / rights;
  }
  return means;
}

double mean(const std::array<double, kMaxWheels>& shares, const std::array<double, kMaxWheels>& turned,
            std::size_t wheels = kMaxWheels) {
  double sum = 0.0;
  for (std::size_t i = 0; i < wheels; ++i) sum += shares[i] * turned[i];
  return sum;
}

}  // namespace

bool can_scrub(const Chassis& chassis) {
  return scrub_sides(chassis) != std::array<double, kMaxWheels>{};
}

std::array<double, kMaxWheels> scrub_sides(const Chassis& chassis) {
  const auto sides = is_steered(chassis) ? std::nullopt : sides_of(chassis);
  if (!sides) return {};
  std::array<double, kMaxWheels> side{};
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i) {
    const Wheel& wheel = chassis.wheels()[i];
    if (wheel.kind == WheelKind::skid && wheel.y_m != sides->middle())
      side[i] = wheel.y_m < sides->middle() ? 1.0 : -1.0;
  }
  const bool on_both = std::ranges::count(side, 1.0) > 0 && std::ranges::count(side, -1.0) > 0;
  return on_both ? side : std::array<double, kMaxWheels>{};
}

double half_difference(const Chassis& chassis, const std::array<double, kMaxWheels>& turned) {
  const Means means = means_of(chassis);
  return 0.5 * (mean(means.right, turned) - mean(means.left, turned));
}

double sharpness(double left_turned, double right_turned) {
  const double squares = squared(left_turned) + squared(right_turned);
  return squares > 0.0 ? 0.5 * squared(right_turned - left_turned) / squares : 0.0;
}

std::array<double, kMaxWheels> without_scrub(const Chassis& chassis,
                                             const std::array<double, kMaxWheels>& turned) {
  const Means means = means_of(chassis);
  const double left = mean(means.left, turned), right = mean(means.right, turned);
  const double lost = chassis.scrub * 0.5 * (right - left) * sharpness(left, right);
  const std::array<double, kMaxWheels> side = scrub_sides(chassis);
  std::array<double, kMaxWheels> ground = turned;
  for (std::size_t i = 0; i < ground.size(); ++i) ground[i] -= side[i] * lost;
  return ground;
}

// With s half the sum of both sides' turns and x half their difference: x (1 − scrub x²/(x² + s²)) =
// ground's. Its derivative lies between 1 − 9/8 |scrub| and 1 + |scrub|: Newton's steps converge.
std::array<double, kMaxWheels> with_scrub(const Chassis& chassis,
                                          const std::array<double, kMaxWheels>& turned) {
  constexpr int kMostSteps = 50;     // each about doubles the digits, once it is near
  constexpr double kSolved = 1e-15;  // a rounding error
  const Means means = means_of(chassis);
  const double left = mean(means.left, turned), right = mean(means.right, turned);
  const double ground = 0.5 * (right - left), middle = 0.5 * (right + left);
  double x = ground;
  for (int step = 0; step < kMostSteps; ++step) {
    const double sharp = sharpness(middle - x, middle + x);
    const double slope = 1.0 - chassis.scrub * sharp * (3.0 - 2.0 * sharp);
    const double change = (x * (1.0 - chassis.scrub * sharp) - ground) / slope;
    x -= change;
    if (std::abs(change) <= kSolved * std::abs(x)) break;
  }
  const std::array<double, kMaxWheels> side = scrub_sides(chassis);
  std::array<double, kMaxWheels> wheels = turned;
  for (std::size_t i = 0; i < wheels.size(); ++i) wheels[i] += side[i] * (x - ground);
  return wheels;
}

ScrubGauge::ScrubGauge(const Chassis& chassis)
    : applies_(can_scrub(chassis)), wheels_(chassis.wheels().size()) {
  const Means means = means_of(chassis);
  left_ = means.left;
  right_ = means.right;
  for (const Wheel& wheel : chassis.wheels())
    memory_ = std::max(memory_, 2.0 * revolutions_of(wheel, kMemory_m, kMemoryTicks));
}

// In the middle of an interval: what is rounded off at its end is as much in the turn as it is not, so that
// rounding does not make turns sharper, however short intervals are.
void ScrubGauge::add(ScrubState& state, Increment& increment) const {
  const double left = mean(left_, increment.turned, wheels_);
  const double right = mean(right_, increment.turned, wheels_);
  const auto go_half = [&] {
    const double kept = memory_ / (memory_ + 0.5 * (std::abs(left) + std::abs(right)));
    state.left = kept * state.left + 0.5 * left;
    state.right = kept * state.right + 0.5 * right;
  };
  go_half();
  increment.scrub_turned = 0.5 * (right - left) * sharpness(state.left, state.right);
  go_half();
}

}  // namespace trundle::chassis
