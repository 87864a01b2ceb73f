#pragma once

namespace trundle {

constexpr double squared(double x) {
  return x * x;
}

}  // namespace trundle
