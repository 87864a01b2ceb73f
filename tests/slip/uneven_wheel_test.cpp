// A wheel that is not round errs once in each of its own turns: the residual is periodic in its angle.
#include "trundle/slip/uneven_wheel.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "trundle/statistics/random.hpp"

#include "chassis/robots.hpp"

namespace trundle::slip {
namespace {

constexpr double kRow_s = 0.1;

Robot small_wheels() {
  Robot robot = test::robot_of(differential_drive({.diameter_m = 0.07, .ticks_per_revolution = 0.0}, 0.23));
  robot.chassis.noise.wheel_per_sqrt_m = 0.001;
  robot.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4};
  return robot;
}

/// 60 s of driving at 0.25 m/s on a line that winds or not, `wheel` longer by a share of cos(its angle).
PerWheel probability_after(double winding_rad_s, int wheel, double share) {
  const Robot robot = small_wheels();
  const Parity parity(robot);
  UnevenWheel uneven;
  Random random(3);
  PerWheel angle{};
  for (int k = 0; k < 600; ++k) {
    const double turn = winding_rad_s * std::sin(0.3 * kRow_s * k) * kRow_s;
    Increment increment = test::increment_of(robot.chassis, {0.025, 0.0, turn}, kRow_s);
    increment.gyro_rad += random.normal(3e-4 * std::sqrt(kRow_s));
    for (std::size_t i = 0; i < 2; ++i) {
      const double before = angle[i];
      angle[i] += 2.0 * kPi * increment.turned[i];
      if (static_cast<int>(i) == wheel)
        increment.turned[i] += share * (std::sin(angle[i]) - std::sin(before)) / (2.0 * kPi);
      increment.turned[i] += random.normal(0.001 * std::sqrt(0.025)) / (kPi * 0.07);
    }
    uneven.add(parity.contradiction({increment, {}}, nullptr), parity);
  }
  return uneven.probability(2);
}

TEST(UnevenWheel, IsTheOneInWhoseAngleTheResidualIsPeriodic) {
  EXPECT_GT(probability_after(0.3, 0, 0.03)[0], 0.99);
  EXPECT_GT(probability_after(0.3, 1, 0.03)[1], 0.99);
}

TEST(UnevenWheel, IsNoneWhereBothAreRound) {
  EXPECT_NEAR(probability_after(0.3, -1, 0.0)[0], 0.5, 0.1);
}

TEST(UnevenWheel, BeforeAnyReadingAllAreAlike) {
  const PerWheel probability = UnevenWheel{}.probability(3);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(probability[i], 1.0 / 3.0);
}

}  // namespace
}  // namespace trundle::slip
