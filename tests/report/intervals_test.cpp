#include "trundle/report/intervals.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "trundle/statistics/distribution.hpp"

namespace trundle::report {
namespace {

/// P(|T| ≤ t) by Simpson's rule over Student's density.
double probability_within(double t, int degrees_of_freedom) {
  const double n = degrees_of_freedom;
  const double scale = std::exp(std::lgamma((n + 1.0) / 2.0) - std::lgamma(n / 2.0)) / std::sqrt(n * kPi);
  const auto density = [&](double x) { return scale * std::pow(1.0 + x * x / n, -(n + 1.0) / 2.0); };
  constexpr int kSteps = 20000;
  const double h = t / kSteps;
  double sum = density(0.0) + density(t);
  for (int i = 1; i < kSteps; ++i) sum += (i % 2 == 0 ? 2.0 : 4.0) * density(i * h);
  return 2.0 * sum * h / 3.0;
}

ParameterEstimate track() {
  ParameterEstimate estimate;
  estimate.nominal = 0.2;
  estimate.value = 0.21;
  estimate.sigma_within = 0.003;
  estimate.observable = true;
  return estimate;
}

TEST(Intervals, StudentsQuantileHolds95Percent) {
  for (int n = 1; n <= 400; n += n < 30 ? 1 : 37)
    EXPECT_NEAR(probability_within(student_t_limit(0.05, n), n), 0.95, 2e-6) << n << " degrees of freedom";
}

TEST(Intervals, WithinComesFromTheNoiseOfTheRuns) {
  const Interval interval = interval95_within(track()).value();
  EXPECT_NEAR(interval.first, 0.21 - 1.959964 * 0.003, 1e-8);
  EXPECT_NEAR(interval.second, 0.21 + 1.959964 * 0.003, 1e-8);
}

TEST(Intervals, BetweenIsThatOfAFurtherSession) {
  ParameterEstimate estimate = track();
  estimate.sigma_between = 0.004;
  const Interval interval = interval95_between(estimate, 4).value();
  const double half = 3.182446 * std::sqrt(0.004 * 0.004 * 1.25 + 0.003 * 0.003);
  EXPECT_NEAR(interval.second - estimate.value, half, 1e-8);
  EXPECT_NEAR(estimate.value - interval.first, half, 1e-8);
}

TEST(Intervals, BetweenIsUnknownWithoutASpreadOrWithOneSession) {
  ParameterEstimate estimate = track();
  EXPECT_FALSE(interval95_between(estimate, 3));
  estimate.sigma_between = 0.004;
  EXPECT_FALSE(interval95_between(estimate, 1));
  EXPECT_TRUE(interval95_between(estimate, 2));
}

TEST(Intervals, AHeldParameterHasNone) {
  ParameterEstimate estimate = track();
  estimate.observable = false;
  estimate.sigma_between = 0.004;
  EXPECT_FALSE(interval95_within(estimate));
  EXPECT_FALSE(interval95_between(estimate, 3));
}

TEST(Intervals, ASigmaThatIsNotFiniteGivesNone) {
  ParameterEstimate estimate = track();
  estimate.sigma_within = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(interval95_within(estimate));
}

}  // namespace
}  // namespace trundle::report
