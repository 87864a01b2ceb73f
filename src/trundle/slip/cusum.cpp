#include "trundle/slip/cusum.hpp"

#include <cmath>

namespace trundle::slip {
namespace {

// Mean overshoot of a normal random walk over a barrier, twice.
constexpr double kOvershoot = 1.166;

double run_length(double limit, double allowance) {
  const double b = 2.0 * allowance * (limit + kOvershoot);
  return (std::exp(b) - b - 1.0) / (2.0 * allowance * allowance);
}

}  // namespace

double cusum_limit(double intervals, double allowance) {
  double low = 0.0;
  double high = 1.0;
  while (run_length(high, allowance) < intervals) high *= 2.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (run_length(middle, allowance) < intervals ? low : high) = middle;
  }
  return high;
}

}  // namespace trundle::slip
