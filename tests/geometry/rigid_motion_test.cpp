#include "trundle/geometry/rigid_motion.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace trundle::geometry {
namespace {

TEST(RigidMotion, IsFoundAgain) {
  const Pose2 motion{3.0, -20.0, 2.5};
  std::vector<PointPair> pairs;
  for (const Vector2& p : {Vector2(0.0, 0.0), Vector2(1.0, 4.0), Vector2(-2.0, 3.0)})
    pairs.push_back({p, motion * p});
  const auto found = rigid_motion(pairs);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->x, motion.x, 1e-12);
  EXPECT_NEAR(found->y, motion.y, 1e-12);
  EXPECT_NEAR(found->heading, motion.heading, 1e-12);
}

TEST(RigidMotion, OfLeastSquaresIsWorseNowhereNear) {
  const std::vector<PointPair> pairs = {{{0.0, 0.0}, {1.0, 0.1}},
                                        {{2.0, 0.0}, {1.2, 2.0}},
                                        {{0.0, 1.0}, {-0.3, 0.2}},
                                        {{4.0, 3.0}, {-2.0, 4.1}}};
  const auto cost = [&](const Pose2& motion) {
    double sum = 0.0;
    for (const PointPair& pair : pairs) sum += (pair.to - motion * pair.from).squaredNorm();
    return sum;
  };
  const Pose2 best = rigid_motion(pairs).value();
  for (const double step : {-1e-3, 1e-3}) {
    EXPECT_LT(cost(best), cost({best.x + step, best.y, best.heading}));
    EXPECT_LT(cost(best), cost({best.x, best.y + step, best.heading}));
    EXPECT_LT(cost(best), cost({best.x, best.y, best.heading + step}));
  }
}

TEST(RigidMotion, IsNotToldByOnePlace) {
  EXPECT_FALSE(rigid_motion({}));
  EXPECT_FALSE(rigid_motion(std::vector<PointPair>{{{1.0, 2.0}, {0.0, 0.0}}}));
  EXPECT_FALSE(rigid_motion(std::vector<PointPair>(5, {{1.0, 2.0}, {3.0, 4.0}})));
}

}  // namespace
}  // namespace trundle::geometry
