#include "trundle/statistics/descent.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trundle::statistics {
namespace {

/// χ² = (x³ − 8)², with a linearisation that is singular at x = 0: there every step is refused until it is
/// damped.
struct Cubic {
  double x;
  int most_damped = 60;
  double damping = 0.0;
  int damped = 0;
  double step = 0.0;

  double error(double at) const { return 8.0 - at * at * at; }

  std::optional<NewtonStep> solve() {
    const double J = 3.0 * x * x;
    const double N = J * J + damping;
    if (N == 0.0) return std::nullopt;
    step = J * error(x) / N;
    return NewtonStep{.sigmas = std::abs(step) * std::sqrt(N), .parameter = 0};
  }
  bool advance() {
    if (std::abs(error(x + step)) >= std::abs(error(x))) return false;
    x += step;
    damping = 0.0;
    return true;
  }
  bool damp() {
    damping = damping == 0.0 ? 1.0 : 4.0 * damping;
    return ++damped < most_damped;
  }
};

TEST(Descent, FindsTheMinimumThroughStepsThatWouldLeadTooFar) {
  Cubic problem{.x = 0.1};  // the first full step goes to 267
  const Descent descent = descend(problem, {.converged = 1e-9});
  EXPECT_TRUE(descent.converged);
  EXPECT_NEAR(problem.x, 2.0, 1e-9);
  EXPECT_LT(descent.last_step, 1e-9);
  EXPECT_EQ(descent.parameter, 0);
  EXPECT_GT(problem.damped, 0);
}

TEST(Descent, StopsAfterItsIterations) {
  Cubic problem{.x = 4.0};
  const Descent descent = descend(problem, {.most_iterations = 2, .converged = 1e-9});
  EXPECT_FALSE(descent.converged);
  EXPECT_EQ(descent.iterations, 2);
  EXPECT_GT(descent.last_step, 1e-9);
}

TEST(Descent, StopsWhereNoStepIsShortEnough) {
  Cubic problem{.x = 0.1, .most_damped = 1};
  const Descent descent = descend(problem, {});
  EXPECT_FALSE(descent.converged);
  EXPECT_EQ(descent.iterations, 1);
  EXPECT_EQ(problem.x, 0.1);
}

TEST(Descent, DampsASingularSystem) {
  Cubic problem{.x = 0.0};
  const Descent descent = descend(problem, {});
  EXPECT_EQ(problem.damped, 1);  // then the gradient is zero too: it stays
  EXPECT_TRUE(descent.converged);
  EXPECT_EQ(descent.iterations, 2);
}

}  // namespace
}  // namespace trundle::statistics
