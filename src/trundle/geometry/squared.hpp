#pragma once

#include "trundle/namespaces.hpp"

namespace trundle::geometry {

constexpr double squared(double x) {
  return x * x;
}

}  // namespace trundle::geometry
