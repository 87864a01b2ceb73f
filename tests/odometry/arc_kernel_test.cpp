#include "trundle/odometry/arc_kernel.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "trundle/geometry/angle.hpp"

namespace trundle {
namespace {

TEST(ArcKernel, SineAndCosineToTheirBound) {
  std::mt19937_64 random(1);
  for (const double range : {1e-9, 0.5, 4.0, 1e3, kLargestAngle}) {
    std::uniform_real_distribution<double> any(-range, range);
    double worst = 0.0;
    for (int i = 0; i < 20000; ++i) {
      const long double x = any(random);
      const SinCos<double> computed = sin_cos(static_cast<double>(x));
      worst = std::max({worst, static_cast<double>(std::abs(std::sin(x) - computed.sin)),
                        static_cast<double>(std::abs(std::cos(x) - computed.cos))});
    }
    EXPECT_LT(worst, 2e-16) << range;
  }
}

TEST(ArcKernel, QuarterTurns) {
  EXPECT_EQ(sin_cos(0.0).sin, 0.0);
  EXPECT_EQ(sin_cos(0.0).cos, 1.0);
  for (int quarter = -8; quarter <= 8; ++quarter) {
    const double angle = 0.5 * kPi * quarter;
    EXPECT_NEAR(sin_cos(angle).sin, std::sin(angle), 1e-16);
    EXPECT_NEAR(sin_cos(angle).cos, std::cos(angle), 1e-16);
  }
}

TEST(ArcKernel, SincAndItsDerivative) {
  for (int i = -500; i <= 500; ++i) {
    const double u = kLargestHalfTurn * i / 500.0;
    EXPECT_NEAR(half_sinc(u), sinc(u), 2.3e-16) << u;
    EXPECT_NEAR(half_sinc_derivative(u), sinc_derivative(u), 2e-15) << u;
  }
}

}  // namespace
}  // namespace trundle
