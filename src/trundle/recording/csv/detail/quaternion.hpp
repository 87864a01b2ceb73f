#pragma once

#include <cmath>

#include "trundle/namespaces.hpp"

namespace trundle::recording {

/// A rotation, of any length but zero.
struct Quaternion {
  double x, y, z, w;

  double length2() const { return x * x + y * y + z * z + w * w; }
};

/// The heading of what was turned by it [rad]: of yaw after pitch after roll, the yaw.
inline double yaw_of(const Quaternion& q) {
  return std::atan2(2.0 * (q.w * q.z + q.x * q.y), q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z);
}

}  // namespace trundle::recording
