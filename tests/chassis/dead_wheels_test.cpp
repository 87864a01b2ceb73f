// The velocity equations that were published for two passive omni wheels and a gyro are the rows of that
// chassis.
#include <gtest/gtest.h>

#include "chassis/robots.hpp"

namespace trundle::chassis {
namespace {

/// V_X = V2, V_Y = (V1 − V2 sin α)/cos α, ω = ω′: docs/theory/dead-wheels.md, eq. 1.
Twist2 published(double v1, double v2, double omega, double alpha) {
  return {v2, (v1 - v2 * std::sin(alpha)) / std::cos(alpha), omega};
}

Chassis pods_with(double alpha) {
  // Pod 1, then pod 2; both rolling planes pass through the centre, wherever along them the wheels stand.
  const double theta = 0.5 * kPi - alpha;
  const std::array<Pod, 2> pods{{{0.13 * std::cos(theta), 0.13 * std::sin(theta), theta}, {-0.08, 0.0, 0.0}}};
  return dead_wheels(test::kSize, pods, Gyro{});
}

TEST(DeadWheels, of_the_published_robot_have_its_rows) {
  for (const double alpha : {-0.3, -0.02, 0.0, 0.1, 0.3}) {
    const Rows rows = rows_of(pods_with(alpha), true);
    const Matrix3 expected =
        (Matrix3() << std::sin(alpha), std::cos(alpha), 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0).finished();
    ASSERT_EQ(rows.count(), 3);
    EXPECT_LT((rows.H - expected).cwiseAbs().maxCoeff(), 1e-15) << alpha;
  }
}

TEST(DeadWheels, give_the_published_velocities) {
  std::mt19937_64 engine(4);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (int i = 0; i < 1000; ++i) {
    const Chassis chassis = pods_with(0.3 * uniform(engine));
    const double alpha = 0.5 * kPi - chassis.wheels()[0].direction_rad;
    const double v1 = uniform(engine);
    const double v2 = uniform(engine);
    const double omega = uniform(engine);
    Increment increment{.duration_s = 1.0, .gyro_rad = omega, .has_gyro = true};
    increment.turned = {v1 / (kPi * test::kSize.diameter_m), v2 / (kPi * test::kSize.diameter_m)};
    const Rows rows = rows_of(chassis, true);
    const Twist2 twist = estimate_twist(rows, readings_of(chassis, rows, increment)).twist;
    EXPECT_LT((twist.vector() - published(v1, v2, omega, alpha).vector()).norm(), 1e-14);
  }
}

}  // namespace
}  // namespace trundle::chassis
