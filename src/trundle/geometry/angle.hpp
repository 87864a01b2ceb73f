#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <string_view>

#include "trundle/namespaces.hpp"

namespace trundle::geometry {

inline constexpr double kPi = std::numbers::pi;
/// Rounded once, where long double is longer than double: radians(90) is kPi / 2, degrees(kPi / 4) is 45.
[[nodiscard]] inline constexpr double radians(double degrees) {
  return static_cast<double>(degrees * (std::numbers::pi_v<long double> / 180.0L));
}
[[nodiscard]] inline constexpr double degrees(double radians) {
  return static_cast<double>(radians * (180.0L / std::numbers::pi_v<long double>));
}

/// Radians of a decimal number of degrees, read with all its digits; NaN when the text is no number.
[[nodiscard]] double radians_of_text(std::string_view degrees);
/// The shortest decimal number of degrees that radians_of_text() reads back to the same bits. Doubles of
/// degrees lie too far apart to name every double of radians, so it may have up to 21 digits. Needs a finite
/// angle.
[[nodiscard]] std::string degrees_text(double radians);

/// The same direction in (−π, π]. The only place where angles are wrapped.
[[nodiscard]] inline double wrap_angle(double angle) {
  if (angle > -kPi && angle <= kPi) return angle;  // as remainder() would give, bit by bit, but at once
  const double wrapped = std::remainder(angle, 2.0 * kPi);
  return wrapped <= -kPi ? wrapped + 2.0 * kPi : wrapped;
}

/// The representative of `angle` nearest to `previous`: makes a sequence of wrapped headings continuous.
[[nodiscard]] inline double unwrap_angle(double angle, double previous) {
  return previous + wrap_angle(angle - previous);
}

/// sin(x)/x, exact at and near zero.
[[nodiscard]] double sinc(double x);
/// (1 − cos x)/x, exact at and near zero.
[[nodiscard]] double cosc(double x);
/// d sinc(x)/dx and d cosc(x)/dx, by series near zero.
[[nodiscard]] double sinc_derivative(double x);
[[nodiscard]] double cosc_derivative(double x);

}  // namespace trundle::geometry
