#include "trundle/geometry/angle.hpp"

#include <bit>
#include <cstdint>

#include <gtest/gtest.h>

#include "geometry/twists.hpp"

namespace trundle::geometry {
namespace {

using test::uniform;

constexpr double kEps = std::numeric_limits<double>::epsilon();

std::vector<double> arguments() {
  std::vector<double> all = test::delicate_turns();
  for (double x = 1e-15; x < 50.0; x *= 1.37) all.insert(all.end(), {x, -x});
  return all;
}

/// 1 − cos x in long double, without cancellation.
long double versine(long double x) {
  const long double s = std::sin(x / 2);
  return 2 * s * s;
}

TEST(Angle, sinc_and_cosc_agree_with_long_double) {
  EXPECT_EQ(sinc(0.0), 1.0);
  EXPECT_EQ(cosc(0.0), 0.0);
  for (const double x : arguments()) {
    if (x == 0.0) continue;
    const long double exact = x;
    EXPECT_NEAR(sinc(x), static_cast<double>(std::sin(exact) / exact), 2 * kEps) << x;
    const auto c = static_cast<double>(versine(exact) / exact);
    EXPECT_NEAR(cosc(x), c, 4 * kEps * std::abs(c) + 1e-300) << x;
  }
}

TEST(Angle, derivatives_of_sinc_and_cosc_agree_with_long_double) {
  EXPECT_EQ(sinc_derivative(0.0), 0.0);
  EXPECT_EQ(cosc_derivative(0.0), 0.5);
  for (const double x : arguments()) {
    if (std::abs(x) < 0.01) continue;  // the closed forms below lose their digits there
    const long double t = x;
    const auto ds = static_cast<double>((std::cos(t) - std::sin(t) / t) / t);
    EXPECT_NEAR(sinc_derivative(x), ds, 16 * kEps) << x;
    const auto dc = static_cast<double>(std::sin(t) / t - versine(t) / (t * t));
    EXPECT_NEAR(cosc_derivative(x), dc, 8 * kEps) << x;
  }
}

TEST(Angle, derivatives_of_sinc_and_cosc_near_zero_are_their_series) {
  for (const double x : {1e-300, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 9e-3}) {
    const double ds = -x / 3 + x * x * x / 30;
    const double dc = 0.5 - x * x / 8 + x * x * x * x / 144;
    EXPECT_NEAR(sinc_derivative(x), ds, 4 * kEps * std::abs(ds) + std::pow(x, 5) / 400) << x;
    EXPECT_EQ(sinc_derivative(-x), -sinc_derivative(x));
    EXPECT_NEAR(cosc_derivative(x), dc, 4 * kEps + std::pow(x, 6)) << x;
    EXPECT_EQ(cosc_derivative(-x), cosc_derivative(x));
  }
}

TEST(Angle, series_and_closed_form_meet) {
  const double below = 0.25;
  const double above = std::nextafter(below, 1.0);
  EXPECT_NEAR(sinc(below), sinc(above), 2 * kEps);
  EXPECT_NEAR(sinc_derivative(below), sinc_derivative(above), 16 * kEps);
}

TEST(Angle, wraps_into_half_open_interval) {
  EXPECT_EQ(wrap_angle(0.0), 0.0);
  EXPECT_EQ(wrap_angle(kPi), kPi);
  EXPECT_EQ(wrap_angle(-kPi), kPi);
  EXPECT_EQ(wrap_angle(3 * kPi), kPi);
  EXPECT_LT(wrap_angle(std::nextafter(kPi, 4.0)), 0.0);
  for (const double angle : {std::nextafter(-kPi, 0.0), -1.0, -0.0, 1e-310, 3.0, kPi})
    EXPECT_EQ(std::bit_cast<std::uint64_t>(wrap_angle(angle)),
              std::bit_cast<std::uint64_t>(std::remainder(angle, 2.0 * kPi)))
        << angle;
  EXPECT_DOUBLE_EQ(wrap_angle(-1.5 * kPi), 0.5 * kPi);
  EXPECT_NEAR(wrap_angle(2000 * kPi + 1.0), 1.0, 1e-12);
}

RC_GTEST_PROP(Angle, wrapped_is_the_same_direction, ()) {
  const double angle = *uniform(-100, 100);
  const double wrapped = wrap_angle(angle);
  RC_ASSERT(wrapped > -kPi);
  RC_ASSERT(wrapped <= kPi);
  const double turns = (angle - wrapped) / (2 * kPi);
  RC_ASSERT(std::abs(turns - std::round(turns)) < 1e-12);
}

RC_GTEST_PROP(Angle, unwrapping_follows_a_sequence, ()) {
  const double previous = *uniform(-100, 100);
  const double step = *uniform(-3.1, 3.1);
  RC_ASSERT(std::abs(unwrap_angle(wrap_angle(previous + step), previous) - (previous + step)) < 1e-12);
}

TEST(Angle, round_angles_are_exact) {
  EXPECT_EQ(radians(90), 0.5 * kPi);
  EXPECT_EQ(radians(-180), -kPi);
  EXPECT_EQ(radians(45), 0.25 * kPi);
  EXPECT_EQ(degrees(kPi), 180.0);
  EXPECT_EQ(degrees(0.25 * kPi), 45.0);
}

TEST(Angle, degrees_as_text_are_short_where_they_can_be) {
  EXPECT_EQ(degrees_text(0.0), "0");
  EXPECT_EQ(degrees_text(radians(-150)), "-150");
  EXPECT_EQ(degrees_text(radians(77.123)), "77.123");
  EXPECT_EQ(radians_of_text("90"), 0.5 * kPi);
  EXPECT_EQ(radians_of_text("+1e1"), radians(10));
}

TEST(Angle, text_that_is_no_number_is_nan) {
  for (const char* text : {"", "x", "1.0x", "1 ", "0x1G", "++1"})
    EXPECT_TRUE(std::isnan(radians_of_text(text))) << text;
}

RC_GTEST_PROP(Angle, degrees_as_text_keep_every_bit, ()) {
  const int exponent = *rc::gen::inRange(-40, 10);
  const double angle = std::ldexp(*uniform(-1, 1), exponent);
  RC_ASSERT(radians_of_text(degrees_text(angle)) == angle);
}

TEST(Angle, degrees_as_text_keep_every_bit_where_doubles_of_degrees_are_sparse) {
  // From 1.117 to 2 (times a power of 2) doubles of degrees are further apart than those of radians.
  double angle = 1.2;
  int without_double = 0;
  for (int i = 0; i < 1000; ++i, angle = std::nextafter(angle, 2.0)) {
    EXPECT_EQ(radians_of_text(degrees_text(angle)), angle);
    if (radians(degrees(angle)) != angle) ++without_double;
  }
  EXPECT_GT(without_double, 50);
}

}  // namespace
}  // namespace trundle::geometry
