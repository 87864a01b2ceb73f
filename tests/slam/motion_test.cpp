#include "trundle/slam/models/motion.hpp"

#include <gtest/gtest.h>

namespace trundle::slam {
namespace {

Twist2 wrong_by(const Twist2& twist, const Systematic& s) {
  return {twist.dx * (1.0 + s[0]), twist.dy * (1.0 + s[0]), twist.dtheta * (1.0 + s[1]) + twist.dx * s[2]};
}

TEST(Motion, DerivativeBySystematicErrorsAgreesWithDifferences) {
  const std::vector<Twist2> twists = {{0.5, 0.0, 0.2}, {0.3, 0.1, -0.9}, {0.0, 0.0, 1.2}, {0.7, -0.2, 0.0}};
  Motion all;
  for (const Twist2& twist : twists) all = all * motion_of(twist, Matrix3::Zero());
  constexpr double h = 1e-6;
  for (int i = 0; i < 3; ++i) {
    const auto end_with = [&](double by) {
      Pose2 pose;
      for (const Twist2& twist : twists) pose = pose * exp(wrong_by(twist, by * Vector3::Unit(i)));
      return log(all.mean.inverse() * pose).vector();
    };
    const Vector3 difference = (end_with(h) - end_with(-h)) / (2.0 * h);
    EXPECT_LT((all.by_systematic.col(i) - difference).norm(), 1e-8) << i;
  }
}

TEST(Motion, NoiseComposesAsThatOfPoses) {
  const Motion a = motion_of({0.5, 0.0, 0.2}, Vector3(0.1, 0.2, 0.3).asDiagonal());
  const Motion b = motion_of({0.3, 0.1, -0.9}, Vector3(0.3, 0.1, 0.2).asDiagonal());
  const GaussianPose expected = GaussianPose{a.mean, a.covariance} * GaussianPose{b.mean, b.covariance};
  EXPECT_LT(((a * b).covariance - expected.covariance).norm(), 1e-15);
  EXPECT_EQ((a * b).mean.x, expected.mean.x);
}

}  // namespace
}  // namespace trundle::slam
