#pragma once

#include <array>

#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/symmetric3.hpp"
#include "trundle/odometry/triple.hpp"

namespace trundle::odometry {

/// The raw readings of an interval as one vector u: `turned` of each wheel (forward and turn without wheels);
/// then, where the gyro is used, its integral and the duration; then what skid wheels scrub; then
/// `speed_turned` of each wheel. Readings z and twist are linear in it.
inline constexpr int kMaxInputs = kMaxWheels + 3;  ///< without speeds
inline constexpr int kAllInputs = kMaxInputs + kMaxWheels;

/// The parameters an odometer carries along, and the gyro's bias.
inline constexpr int kMaxModelParameters = 39;

/// A vector of three for each wheel, component by component: (dx, dy, dθ), or (x, y, heading).
struct WheelVectors {
  std::array<double, kMaxWheels> x, y, h;
};

/// The twist of an interval, its noise, and its derivatives by the model's parameters.
struct TwistStep {
  std::array<double, 3> twist;
  Symmetric3 covariance;   ///< without the rounding of counts
  WheelVectors by_travel;  ///< ∂ξ/∂(travel of each wheel) [1/m, 1/m, rad/m]
  std::array<std::array<double, 3>, kMaxModelParameters> derivative;  ///< ∂ξ/∂p for each parameter
};

}  // namespace trundle::odometry
