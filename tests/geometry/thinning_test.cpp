#include "trundle/geometry/thinning.hpp"

#include <gtest/gtest.h>

namespace trundle::geometry {
namespace {

ThinnedTrajectory thinned_of(int poses, std::size_t most) {
  ThinnedTrajectory thinned(most, true);
  for (int i = 0; i < poses; ++i)
    thinned.add({0.1 * i, {1.0 * i, -1.0 * i, 0.0}}, (i + 1.0) * Matrix3::Identity());
  return thinned;
}

TEST(ThinnedTrajectory, KeepsAllOfAFew) {
  ThinnedTrajectory thinned = thinned_of(8, 8);
  EXPECT_EQ(thinned.left_out(), 0);
  EXPECT_EQ(thinned.take().poses.size(), 8);
}

TEST(ThinnedTrajectory, KeepsThoseAtEqualStepsAndTheLast) {
  for (int poses = 9; poses < 200; ++poses) {
    SCOPED_TRACE(poses);
    ThinnedTrajectory thinned = thinned_of(poses, 8);
    const std::size_t left_out = thinned.left_out();
    const Trajectory kept = thinned.take();
    const std::size_t count = kept.poses.size();
    EXPECT_EQ(count + left_out, static_cast<std::size_t>(poses));
    ASSERT_EQ(kept.covariances.size(), count);
    EXPECT_LE(count, 9);
    EXPECT_GE(count, 5);
    const double step = kept.poses[1].pose.x;
    for (std::size_t i = 0; i < count; ++i) {
      const double x = i + 1 == count ? poses - 1.0 : step * static_cast<double>(i);
      EXPECT_EQ(kept.poses[i].pose.x, x);
      EXPECT_EQ(kept.covariances[i](1, 1), x + 1.0);
    }
  }
}

TEST(ThinnedTrajectory, HasNoCovariancesWhereThereAreNone) {
  ThinnedTrajectory thinned(2, false);
  for (int i = 0; i < 9; ++i) thinned.add({0.1 * i, {}}, Matrix3::Zero());
  EXPECT_FALSE(thinned.take().has_covariance());
}

}  // namespace
}  // namespace trundle::geometry
