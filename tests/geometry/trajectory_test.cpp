#include "trundle/geometry/trajectory.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace trundle::geometry {
namespace {

Trajectory arc() {
  Trajectory trajectory;
  for (int i = 0; i <= 10; ++i) trajectory.poses.push_back({0.1 * i, exp({0.2 * i, 0.0, 0.5 * i})});
  return trajectory;
}

TEST(PoseAt, lies_on_the_arc_between_its_neighbours) {
  const auto pose = pose_at(arc(), 0.425, 0.5);
  ASSERT_TRUE(pose);
  const Pose2 exact = exp({0.2 * 4.25, 0.0, 0.5 * 4.25});
  EXPECT_NEAR(pose->x, exact.x, 1e-14);
  EXPECT_NEAR(pose->y, exact.y, 1e-14);
  EXPECT_NEAR(pose->heading, exact.heading, 1e-14);
}

TEST(PoseAt, gives_the_very_pose_at_a_stamp) {
  const Trajectory trajectory = arc();
  for (const StampedPose& stamped : trajectory.poses) {
    const auto pose = pose_at(trajectory, stamped.time_s, 0.0);
    ASSERT_TRUE(pose);
    EXPECT_EQ(pose->x, stamped.pose.x);
    EXPECT_EQ(pose->heading, stamped.pose.heading);
  }
}

TEST(PoseAt, has_nothing_outside_or_across_a_gap) {
  Trajectory trajectory = arc();
  EXPECT_FALSE(pose_at(trajectory, -0.01, 1.0));
  EXPECT_FALSE(pose_at(trajectory, 1.01, 1.0));
  EXPECT_FALSE(pose_at(trajectory, std::numeric_limits<double>::quiet_NaN(), 1.0));
  EXPECT_FALSE(pose_at({}, 0.0, 1.0));
  trajectory.poses.push_back({2.0, exp({2.2, 0.0, 5.5})});
  EXPECT_FALSE(pose_at(trajectory, 1.5, 0.5));
  EXPECT_TRUE(pose_at(trajectory, 1.5, 1.0));
}

TEST(PoseAt, keeps_the_turns_of_a_continuous_heading) {
  Trajectory trajectory;
  trajectory.poses = {{0.0, {0.0, 0.0, 6.2}}, {1.0, {0.0, 0.0, 6.4}}};
  EXPECT_NEAR(pose_at(trajectory, 0.5, 1.0)->heading, 6.3, 1e-14);
}

TEST(PoseAt, crosses_pi_the_short_way_when_headings_are_wrapped) {
  Trajectory trajectory;
  trajectory.poses = {{0.0, {0.0, 0.0, 3.1}}, {1.0, {0.0, 0.0, -3.1}}};
  EXPECT_NEAR(pose_at(trajectory, 0.5, 1.0)->heading, kPi, 1e-14);
}

TEST(PathLengths, add_up_the_steps) {
  Trajectory trajectory;
  trajectory.poses = {{0.0, {}}, {1.0, {3.0, 4.0, 1.0}}, {2.0, {3.0, 4.0, 2.0}}, {3.0, {3.0, 5.0, 2.0}}};
  EXPECT_EQ(path_lengths(trajectory), (std::vector<double>{0.0, 5.0, 5.0, 6.0}));
  EXPECT_TRUE(path_lengths({}).empty());
}

}  // namespace
}  // namespace trundle::geometry
