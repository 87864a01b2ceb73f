#include "trundle/simulation/path.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace trundle::simulation {
namespace {

void expect_pose(const Pose2& pose, double x, double y, double heading) {
  EXPECT_NEAR(pose.x, x, 1e-12);
  EXPECT_NEAR(pose.y, y, 1e-12);
  EXPECT_NEAR(pose.heading, heading, 1e-12);
}

TEST(Path, ShapesEndWhereGeometrySays) {
  expect_pose(end_of(straight(3.0)), 3.0, 0.0, 0.0);
  expect_pose(end_of(straight(-3.0)), -3.0, 0.0, 0.0);
  expect_pose(end_of(turn_on_the_spot(-1.0)), 0.0, 0.0, -1.0);
  expect_pose(end_of(square(2.0, TurnSense::ccw)), 0.0, 0.0, 2.0 * kPi);
  expect_pose(end_of(square(2.0, TurnSense::cw)), 0.0, 0.0, -2.0 * kPi);
  expect_pose(end_of(l_run(1.5)), 1.5, 1.5, 0.0);
  expect_pose(end_of(l_run(1.5, TurnSense::cw)), 1.5, -1.5, 0.0);
  expect_pose(end_of(l_run_with_turn(1.5)), 1.5, 1.5, 0.5 * kPi);
  expect_pose(end_of(circle(0.7, 0.5, TurnSense::ccw)), 0.0, 1.4, kPi);
  expect_pose(end_of(circle(0.7, 2.0, TurnSense::cw)), 0.0, 0.0, -4.0 * kPi);
  expect_pose(end_of(figure_eight(0.7)), 0.0, 0.0, 0.0);
}

TEST(Path, LengthsAndDurationsFollowThePace) {
  const Pace pace{.forward_m_s = 0.5, .turn_rad_s = 0.25 * kPi, .rest_s = 1.0};
  EXPECT_NEAR(length_of(square(2.0, TurnSense::cw, pace)), 8.0, 1e-12);
  EXPECT_NEAR(duration_of(square(2.0, TurnSense::cw, pace)), 4.0 * (4.0 + 2.0 + 2.0), 1e-12);
  EXPECT_NEAR(length_of(circle(0.7, 1.5, TurnSense::ccw)), 2.1 * kPi, 1e-12);
  EXPECT_TRUE(straight(0.0).empty());
  EXPECT_TRUE(pause(0.0).empty());
}

TEST(Path, WaypointsAreReachedInOrder) {
  const Pose2 start{1.0, 1.0, 2.0};
  const std::vector<Vector2> points = {{2.0, 1.0}, {2.0, -1.0}, {2.0, -1.0}, {-3.0, 0.5}};
  const Path path = waypoints(start, points);
  EXPECT_LT((end_of(path, start).translation() - points.back()).norm(), 1e-12);
  std::size_t reached = 0;
  Pose2 pose = start;
  for (const Segment& segment : path) {
    pose = pose * exp(segment.motion);
    while (reached < points.size() && (pose.translation() - points[reached]).norm() < 1e-9) ++reached;
  }
  EXPECT_EQ(reached, points.size());
}

TEST(Path, ToursStayInsideTheirBox) {
  for (const bool sideways : {false, true}) {
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      Random random(seed);
      const Tour tour{.length_m = 60.0, .box_x_m = 3.0, .box_y_m = 2.0, .sideways = sideways};
      const Path path = random_tour(tour, {0.5, -0.5, 1.0}, random);
      EXPECT_GE(length_of(path), 60.0);
      EXPECT_LT(length_of(path), 60.0 + tour.longest_segment_m + 1e-9);
      Pose2 pose{0.5, -0.5, 1.0};
      for (const Segment& segment : path) {
        for (int i = 1; i <= 20; ++i) {
          const Pose2 there = pose * exp(Twist2::from(i / 20.0 * segment.motion.vector()));
          // Checked at eighths of at most 1.5 m long arcs: between them an arc leaves by its sagitta at most.
          EXPECT_LT(std::abs(there.x), 1.5 + 0.01);
          EXPECT_LT(std::abs(there.y), 1.0 + 0.01);
        }
        pose = pose * exp(segment.motion);
      }
    }
  }
}

TEST(Path, ToursOfOneSeedAreEqual) {
  Random a(4), b(4), c(5);
  const Path one = random_tour({}, {}, a);
  const Path same = random_tour({}, {}, b);
  const Path other = random_tour({}, {}, c);
  EXPECT_EQ(end_of(one).x, end_of(same).x);
  EXPECT_NE(end_of(one).x, end_of(other).x);
}

TEST(Path, WholeIntervalsKeepTheWayAndOnlyTakeLonger) {
  const Path path = square(1.3, TurnSense::ccw, {.forward_m_s = 0.21, .turn_rad_s = 0.77, .rest_s = 0.33});
  const Path whole = in_whole_intervals(path, 20.0);
  ASSERT_EQ(whole.size(), path.size());
  for (std::size_t i = 0; i < path.size(); ++i) {
    EXPECT_EQ(whole[i].motion.vector(), path[i].motion.vector());
    EXPECT_NEAR(whole[i].duration_s * 20.0, std::round(whole[i].duration_s * 20.0), 1e-9);
    EXPECT_GE(whole[i].duration_s, path[i].duration_s - 1e-9);
    EXPECT_LT(whole[i].duration_s, path[i].duration_s + 0.05);
  }
}

}  // namespace
}  // namespace trundle::simulation
