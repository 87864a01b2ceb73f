#pragma once

#include <array>

#include "trundle/geometry/pose2.hpp"

namespace trundle::recording {

/// The plane that touches the ellipsoid of WGS 84 at a place: x to the east, y to the north. Heights are not
/// looked at.
class LocalFrame {
 public:
  /// [deg]
  LocalFrame(double latitude_deg, double longitude_deg);

  /// [m]
  [[nodiscard]] Vector2 position_of(double latitude_deg, double longitude_deg) const;

 private:
  std::array<double, 3> origin_;  ///< earth-centred [m]
  double sin_latitude_, cos_latitude_, sin_longitude_, cos_longitude_;
};

}  // namespace trundle::recording
