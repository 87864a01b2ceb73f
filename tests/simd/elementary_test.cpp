#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "trundle/geometry/angle.hpp"
#include "trundle/simd/scalar.hpp"
#include "trundle/simd/targets.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/elementary_test.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "trundle/simd/lanes.inl"

// Every function in lanes: y[i] = f(x[i]), as many as are a whole number of vectors.
HWY_BEFORE_NAMESPACE();
namespace trundle::simd::HWY_NAMESPACE {

template <class Function>
HWY_INLINE void each_of(const std::vector<double>& x, std::vector<double>& y, Function f) {
  const Tag<double> d;
  for (std::size_t i = 0; i < x.size(); i += hn::Lanes(d))
    hn::StoreU(f(hn::LoadU(d, x.data() + i)), d, y.data() + i);
}

void all_functions(const std::vector<double>& x, std::vector<std::vector<double>>& y) {
  std::size_t k = 0;
  const auto next = [&](auto f) HWY_ATTR { each_of(x, y[k++], f); };
  next([](Wide v) HWY_ATTR { return sin_cos(v).sin; });
  next([](Wide v) HWY_ATTR { return sin_cos(v).cos; });
  next([](Wide v) HWY_ATTR { return atan2(v, lanes<double>(0.7)); });
  next([](Wide v) HWY_ATTR { return atan2(lanes<double>(-0.7), v); });
  next([](Wide v) HWY_ATTR { return log(abs(v)); });
  next([](Wide v) HWY_ATTR { return exp(v); });
  next([](Wide v) HWY_ATTR { return cos_of_small(v); });
  next([](Wide v) HWY_ATTR { return sinc_of_small(v); });
  next([](Wide v) HWY_ATTR { return sinc_slope_of_small(v); });
  next([](Wide v) HWY_ATTR {
    LogSum<Wide> sum;
    sum.add(abs(v));
    sum.add(v * v);
    return sum.sum();
  });
}

}  // namespace trundle::simd::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trundle::simd {
namespace {

using geometry::sinc, geometry::sinc_derivative;

HWY_EXPORT(all_functions);

TEST(Elementary, EveryInstructionSetAndOneNumberAloneGiveTheSameBits) {
  std::mt19937_64 random(1);
  std::vector<double> x;
  for (const double range : {1e-9, 0.4, 4.0, 700.0}) {
    std::uniform_real_distribution<double> any(-range, range);
    for (int i = 0; i < 1600; ++i) x.push_back(any(random));
  }
  std::vector<std::vector<double>> expected(10);
  for (const double v : x) {
    std::size_t k = 0;
    const auto next = [&](double y) { expected[k++].push_back(y); };
    next(scalar::sin_cos(v).sin);
    next(scalar::sin_cos(v).cos);
    next(scalar::atan2(v, 0.7));
    next(scalar::atan2(-0.7, v));
    next(scalar::log(std::abs(v)));
    next(scalar::exp(v));
    next(scalar::cos_of_small(v));
    next(scalar::sinc_of_small(v));
    next(scalar::sinc_slope_of_small(v));
    scalar::LogSum<double> sum;
    sum.add(std::abs(v));
    sum.add(v * v);
    next(sum.sum());
  }
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    std::vector<std::vector<double>> y(expected.size(), std::vector<double>(x.size()));
    hwy::SetSupportedTargetsForTest(target);
    HWY_DYNAMIC_DISPATCH(all_functions)(x, y);
    hwy::SetSupportedTargetsForTest(0);
    for (std::size_t k = 0; k < y.size(); ++k) EXPECT_EQ(y[k], expected[k]) << hwy::TargetName(target) << k;
  }
}

TEST(Elementary, SineAndCosineToTheirBound) {
  std::mt19937_64 random(1);
  for (const double range : {1e-9, 0.5, 4.0, 1e3, kLargestAngle}) {
    std::uniform_real_distribution<double> any(-range, range);
    double worst = 0.0;
    for (int i = 0; i < 20000; ++i) {
      const long double x = any(random);
      const auto computed = scalar::sin_cos(static_cast<double>(x));
      worst = std::max({worst, static_cast<double>(std::abs(std::sin(x) - computed.sin)),
                        static_cast<double>(std::abs(std::cos(x) - computed.cos))});
    }
    EXPECT_LT(worst, 2e-16) << range;
  }
}

TEST(Elementary, QuarterTurns) {
  EXPECT_EQ(scalar::sin_cos(0.0).sin, 0.0);
  EXPECT_EQ(scalar::sin_cos(0.0).cos, 1.0);
  for (int quarter = -8; quarter <= 8; ++quarter) {
    const double angle = 0.5 * std::numbers::pi * quarter;
    EXPECT_NEAR(scalar::sin_cos(angle).sin, std::sin(angle), 1e-16);
    EXPECT_NEAR(scalar::sin_cos(angle).cos, std::cos(angle), 1e-16);
  }
}

TEST(Elementary, SincAndItsSlope) {
  for (int i = -500; i <= 500; ++i) {
    const double u = kLargestHalfTurn * i / 500.0;
    EXPECT_NEAR(scalar::sinc_of_small(u), sinc(u), 2.3e-16) << u;
    EXPECT_NEAR(scalar::sinc_slope_of_small(u), sinc_derivative(u), 2e-15) << u;
  }
}

TEST(Elementary, Atan2IsTheLibrarys) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  for (int i = 0; i < 100000; ++i) {
    const double angle = std::numbers::pi * any(random);
    const double length = std::exp(20.0 * any(random));
    const double y = length * std::sin(angle);
    const double x = length * std::cos(angle);
    ASSERT_NEAR(scalar::atan2(y, x), std::atan2(y, x), 5e-16 * std::max(1e-3, std::abs(angle)));
  }
  for (const double x : {-1.0, 0.0, 1.0})
    for (const double y : {-1.0, 0.0, 1.0}) EXPECT_NEAR(scalar::atan2(y, x), std::atan2(y, x), 5e-16);
  EXPECT_EQ(scalar::atan2(0.0, 0.0), 0.0);
}

TEST(Elementary, LogIsTheLibrarys) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> any(-700.0, 700.0);
  std::uniform_real_distribution<double> near(0.7, 1.4);
  for (int i = 0; i < 100000; ++i) {
    const double x = std::exp(any(random));
    ASSERT_NEAR(scalar::log(x), std::log(x), 3e-16 * std::max(1.0, std::abs(std::log(x))));
    const double near_one = near(random);
    ASSERT_NEAR(scalar::log(near_one), std::log(near_one), 2e-16);
  }
  EXPECT_EQ(scalar::log(1.0), 0.0);
}

TEST(Elementary, ExpIsTheLibrarys) {
  for (int i = -7080; i <= 7090; ++i) {
    const double x = 0.1 * i;
    EXPECT_NEAR(scalar::exp(x), std::exp(x), 5e-16 * std::exp(x));
  }
  EXPECT_EQ(scalar::exp(-709.0), 0.0);
}

}  // namespace
}  // namespace trundle::simd
#endif
