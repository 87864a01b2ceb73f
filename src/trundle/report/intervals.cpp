#include "trundle/report/intervals.hpp"

#include <cmath>

#include "trundle/statistics/distribution.hpp"

namespace trundle::report {
namespace {

std::optional<Interval> interval(double centre, double half) {
  if (!std::isfinite(centre) || !std::isfinite(half)) return {};
  return Interval{centre - half, centre + half};
}

}  // namespace

std::optional<Interval> interval95_within(const ParameterEstimate& estimate) {
  if (!estimate.observable) return {};
  return interval(estimate.value, kNormalAt95 * estimate.sigma_within);
}

std::optional<Interval> interval95_between(const ParameterEstimate& estimate, int sessions) {
  if (!estimate.observable || !estimate.sigma_between || sessions < 2) return {};
  const double k = sessions;
  const double spread = *estimate.sigma_between;
  const double sigma = std::hypot(spread * std::sqrt(1.0 + 1.0 / k), estimate.sigma_within);
  return interval(estimate.value, student_t_limit(0.05, sessions - 1) * sigma);
}

}  // namespace trundle::report
