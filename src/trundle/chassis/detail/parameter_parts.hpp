#pragma once

#include <optional>

#include "trundle/chassis/parameter.hpp"

namespace trundle::chassis {

// What values of parameters and derivatives by them have in common.

/// Whose place the track is about: an omni wheel, as of a pod beside driven wheels, has one of its own.
[[nodiscard]] inline bool is_of_side(const Wheel& wheel) {
  return wheel.kind != WheelKind::omni;
}

/// Mean y of the wheels left and right of the middle.
struct Sides {
  double left = 0.0;
  double right = 0.0;

  [[nodiscard]] double track() const { return left - right; }
  [[nodiscard]] double middle() const { return 0.5 * (left + right); }
};

/// Nothing where wheels do not stand on two sides.
[[nodiscard]] std::optional<Sides> sides_of(const Chassis& chassis);
/// Of a robot that has them, until an estimate of the track leads nowhere: then CannotAnswer.
[[nodiscard]] Sides track_sides(const Chassis& chassis);

[[nodiscard]] inline const Wheel& wheel_of(const Parameter& parameter, const Chassis& chassis) {
  return chassis.all_wheels()[static_cast<std::size_t>(parameter.wheel)];
}

/// ∂(turn coefficient of the rolling row)/∂(x, y): where to move a wheel to change its lever.
[[nodiscard]] inline Vector2 lever_gradient(const Wheel& wheel) {
  const Vector3 row = rolling_row(wheel);
  return {row.y(), -row.x()};
}

}  // namespace trundle::chassis
