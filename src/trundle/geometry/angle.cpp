#include "trundle/geometry/angle.hpp"

#include <charconv>
#include <limits>

#include <fmt/format.h>

namespace trundle::geometry {
namespace {
// Below this the series, cut after x⁸, is exact to the last bit or two; above it the closed forms lose few
// digits.
constexpr double kSeriesLimit = 0.25;
}  // namespace

double radians_of_text(std::string_view degrees) {
  if (degrees.starts_with('+')) degrees.remove_prefix(1);
  long double value = 0.0L;
  const char* const end = degrees.data() + degrees.size();
  const auto [stop, error] = std::from_chars(degrees.data(), end, value);
  if (error != std::errc{} || stop != end) return std::numeric_limits<double>::quiet_NaN();
  return static_cast<double>(value * (std::numbers::pi_v<long double> / 180.0L));
}

// Trailing zeros are left away, so that to begin with six digits costs no length but keeps 90 from being
// 9e+01.
std::string degrees_text(double radians) {
  const long double degrees = radians * (180.0L / std::numbers::pi_v<long double>);
  std::string text;
  for (int digits = 6; digits <= std::numeric_limits<long double>::max_digits10; ++digits) {
    text = fmt::format("{:.{}g}", degrees, digits);
    if (radians_of_text(text) == radians) break;
  }
  return text;
}

double sinc(double x) {
  if (std::abs(x) > kSeriesLimit) return std::sin(x) / x;
  const double x2 = x * x;
  return 1.0 - x2 / 6.0 * (1.0 - x2 / 20.0 * (1.0 - x2 / 42.0 * (1.0 - x2 / 72.0 * (1.0 - x2 / 110.0))));
}

double cosc(double x) {
  // 1 − cos x = 2 sin²(x/2) has no cancellation at any x.
  const double half = sinc(0.5 * x);
  return 0.5 * x * half * half;
}

double sinc_derivative(double x) {
  if (std::abs(x) > kSeriesLimit) return (std::cos(x) - std::sin(x) / x) / x;
  const double x2 = x * x;
  return -x / 3.0 * (1.0 - x2 / 10.0 * (1.0 - x2 / 28.0 * (1.0 - x2 / 54.0 * (1.0 - x2 / 88.0))));
}

double cosc_derivative(double x) {
  // d/dx [(x/2) sinc²(x/2)]
  const double half = sinc(0.5 * x);
  return 0.5 * half * half + 0.5 * x * half * sinc_derivative(0.5 * x);
}

}  // namespace trundle::geometry
