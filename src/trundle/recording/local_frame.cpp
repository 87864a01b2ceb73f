#include "trundle/recording/detail/local_frame.hpp"

#include <cmath>

#include "trundle/geometry/angle.hpp"

namespace trundle::recording {
namespace {

/// Earth-centred, of a place on the ellipsoid of WGS 84 [m].
std::array<double, 3> earth_centred(double latitude_deg, double longitude_deg) {
  constexpr double kEquator_m = 6378137.0;  // its radius
  constexpr double kFlattening = 1.0 / 298.257223563;
  constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);
  const double latitude = radians(latitude_deg), longitude = radians(longitude_deg);
  const double sine = std::sin(latitude);
  const double normal_m = kEquator_m / std::sqrt(1.0 - kEccentricity2 * sine * sine);
  const double from_axis_m = normal_m * std::cos(latitude);
  return {from_axis_m * std::cos(longitude), from_axis_m * std::sin(longitude),
          normal_m * (1.0 - kEccentricity2) * sine};
}

}  // namespace

LocalFrame::LocalFrame(double latitude_deg, double longitude_deg)
    : origin_(earth_centred(latitude_deg, longitude_deg)),
      sin_latitude_(std::sin(radians(latitude_deg))),
      cos_latitude_(std::cos(radians(latitude_deg))),
      sin_longitude_(std::sin(radians(longitude_deg))),
      cos_longitude_(std::cos(radians(longitude_deg))) {}

Vector2 LocalFrame::position_of(double latitude_deg, double longitude_deg) const {
  const std::array<double, 3> place = earth_centred(latitude_deg, longitude_deg);
  const double dx = place[0] - origin_[0], dy = place[1] - origin_[1], dz = place[2] - origin_[2];
  const double outwards = dx * cos_longitude_ + dy * sin_longitude_;
  return {dy * cos_longitude_ - dx * sin_longitude_, dz * cos_latitude_ - outwards * sin_latitude_};
}

}  // namespace trundle::recording
