#include "trundle/statistics/distribution.hpp"

#include <cassert>
#include <cmath>
#include <limits>

namespace trundle {
namespace {

constexpr double kPrecision = 1e-15;
constexpr double kTiny = 1e-300;
constexpr int kMostTerms = 100'000;

/// Lower incomplete gamma function, regularised, by its series: good for x < a + 1.
double gamma_series(double a, double x) {
  double term = 1.0 / a;
  double sum = term;
  for (int n = 1; n < kMostTerms && term > sum * kPrecision; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * std::exp(a * std::log(x) - x - std::lgamma(a));
}

/// Upper incomplete gamma function, regularised, by its continued fraction (Lentz): good for x >= a + 1.
double gamma_fraction(double a, double x) {
  double b = x + 1.0 - a;
  double c = 1.0 / kTiny;
  double d = 1.0 / b;
  double fraction = d;
  for (int n = 1; n < kMostTerms; ++n) {
    const double an = -n * (n - a);
    b += 2.0;
    d = 1.0 / (an * d + b);
    c = b + an / c;
    fraction *= d * c;
    if (std::abs(d * c - 1.0) < kPrecision) break;
  }
  return fraction * std::exp(a * std::log(x) - x - std::lgamma(a));
}

double upper_gamma(double a, double x) {
  if (x <= 0.0) return 1.0;
  return x < a + 1.0 ? 1.0 - gamma_series(a, x) : gamma_fraction(a, x);
}

double beta_fraction(double a, double b, double x) {
  double c = 1.0;
  double d = 1.0 / (1.0 - (a + b) * x / (a + 1.0));
  double fraction = d;
  for (int m = 1; m < kMostTerms; ++m) {
    const double even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m));
    d = 1.0 / (1.0 + even * d);
    c = 1.0 + even / c;
    fraction *= d * c;
    const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0));
    d = 1.0 / (1.0 + odd * d);
    c = 1.0 + odd / c;
    fraction *= d * c;
    if (std::abs(d * c - 1.0) < kPrecision) break;
  }
  return fraction;
}

/// Incomplete beta function, regularised.
double beta(double a, double b, double x) {
  if (x <= 0.0) return 0.0;
  if (x >= 1.0) return 1.0;
  const double front =
      std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) + a * std::log(x) + b * std::log1p(-x));
  if (x < (a + 1.0) / (a + b + 2.0)) return front * beta_fraction(a, b, x) / a;
  return 1.0 - front * beta_fraction(b, a, 1.0 - x) / b;
}

/// The x > 0 at which a falling tail passes `wanted`.
template <typename Tail>
double limit_of(Tail tail, double wanted) {
  assert(wanted > 0.0 && wanted < 1.0);
  double high = 1.0;
  while (tail(high) > wanted && high < std::numeric_limits<double>::max() / 4.0) high *= 2.0;
  double low = 0.0;
  while (high - low > 4.0 * std::numeric_limits<double>::epsilon() * high) {
    const double middle = 0.5 * (low + high);
    (tail(middle) > wanted ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double chi_squared_tail(double x, double degrees_of_freedom) {
  return upper_gamma(0.5 * degrees_of_freedom, 0.5 * x);
}

double f_tail(double x, double numerator_dof, double denominator_dof) {
  if (x <= 0.0) return 1.0;
  return beta(0.5 * denominator_dof, 0.5 * numerator_dof,
              denominator_dof / (denominator_dof + numerator_dof * x));
}

double chi_squared_limit(double tail, double degrees_of_freedom) {
  return limit_of([=](double x) { return chi_squared_tail(x, degrees_of_freedom); }, tail);
}

double f_limit(double tail, double numerator_dof, double denominator_dof) {
  return limit_of([=](double x) { return f_tail(x, numerator_dof, denominator_dof); }, tail);
}

double normal_limit(double tail) {
  return limit_of([](double z) { return std::erfc(z / std::sqrt(2.0)); }, tail);
}

double student_t_limit(double tail, double degrees_of_freedom) {
  return std::sqrt(f_limit(tail, 1.0, degrees_of_freedom));
}

}  // namespace trundle
