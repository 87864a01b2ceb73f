#include "trundle/chassis/without_wheel.hpp"

#include <algorithm>

namespace trundle::chassis {

Chassis without_wheel(const Chassis& chassis, std::size_t wheel) {
  Chassis rest = chassis;
  rest.wheel_count = 0;
  for (std::size_t i = 0; i < chassis.wheels().size(); ++i)
    if (i != wheel) rest.add(chassis.wheels()[i]);
  return rest;
}

Increment without_wheel(const Increment& increment, std::size_t wheel) {
  Increment rest = increment;
  for (auto* column : {&rest.turned, &rest.slip_variance})
    std::copy(column->begin() + static_cast<std::ptrdiff_t>(wheel) + 1, column->end(),
              column->begin() + static_cast<std::ptrdiff_t>(wheel));
  return rest;
}

}  // namespace trundle::chassis
