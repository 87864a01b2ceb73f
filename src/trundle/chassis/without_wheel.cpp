#include "trundle/chassis/without_wheel.hpp"

#include <algorithm>

namespace trundle::chassis {

Chassis without_wheel(const Chassis& chassis, std::size_t wheel) {
  Chassis rest = chassis;
  std::ranges::copy(chassis.all_wheels().subspan(wheel + 1),
                    rest.wheel_storage.begin() + static_cast<std::ptrdiff_t>(wheel));
  --rest.wheel_count;
  return rest;
}

Increment without_wheel(const Increment& increment, std::size_t wheel) {
  Increment rest = increment;
  for (auto* column : {&rest.turned, &rest.speed_turned, &rest.slip_variance, &rest.steering_rad})
    std::copy(column->begin() + static_cast<std::ptrdiff_t>(wheel) + 1, column->end(),
              column->begin() + static_cast<std::ptrdiff_t>(wheel));
  return rest;
}

std::optional<Chassis> without_steering(const Chassis& chassis) {
  const auto steered = [](const Wheel& wheel) { return wheel.steering.has_value(); };
  if (std::ranges::any_of(chassis.wheels(), steered)) return std::nullopt;
  Chassis rest = chassis;
  for (Wheel& wheel : rest.all_wheels()) {
    if (steered(wheel)) wheel.kind = WheelKind::omni;  // which says nothing; the others keep their places
    wheel.steering.reset();
  }
  return rest;
}

}  // namespace trundle::chassis
