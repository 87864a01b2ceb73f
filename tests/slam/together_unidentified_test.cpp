#include <gtest/gtest.h>

#include "trundle/slam/smoothing/together.hpp"
#include "trundle/statistics/distribution.hpp"

#include "scale.hpp"
#include "slam/team.hpp"

namespace trundle::slam {
namespace {

/// Robots that meet, among landmarks without names.
test::Team team_without_names(test::TeamOptions options) {
  test::Team team = test::team_of(options);
  for (SlamInput& input : team.inputs) {
    input.landmarks.clear();
    for (SlamStep& step : input.steps)
      for (Observation& seen : step.observations) seen.landmark = kUnknownLandmark;
  }
  return team;
}

/// Each as it is found alone: what it maps has numbers of its own.
std::vector<RobotRecording> recordings_without_names(const test::Team& team) {
  std::vector<RobotRecording> robots = test::recordings_of(team);
  LandmarkId next = 0;
  for (RobotRecording& robot : robots) number_unidentified(0, next, robot.shown);
  return robots;
}

// What each maps for itself is found to be one map. In three worlds of 40 two landmarks stay one too many.
TEST(TogetherWithoutNames, FindsWhichLandmarksRobotsBothSee) {
  const int trials = test::trials(40, 4);
  double nees = 0.0;
  std::size_t mapped = 0, there = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const test::Team team =
        team_without_names({.robots = 3, .seed = static_cast<std::uint64_t>(trial) + 500});
    const JointSlam joint = smooth_together(recordings_without_names(team), team.seen);
    mapped += joint.map.size();
    there += team.landmarks.size();
    for (std::size_t i = 0; i < 3; ++i) {
      const Trajectory& path = joint.robots[i].trajectory;
      nees += test::pose_nees(path.poses.back(), path.covariances.back(), team.truth[i].back());
    }
  }
  EXPECT_GE(mapped, there);
  EXPECT_LE(mapped, there + there / 20);
  EXPECT_LT(nees, chi_squared_limit(0.0005, 9 * trials));
  EXPECT_GT(nees, chi_squared_limit(0.9995, 9 * trials));
}

}  // namespace
}  // namespace trundle::slam
