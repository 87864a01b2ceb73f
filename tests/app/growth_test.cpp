// How the online estimate grew, as `trundle slam` writes it and the page shows it.
#include <algorithm>
#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "trundle/io/file.hpp"
#include "trundle/report/results.hpp"

#include "app/process.hpp"
#include "app/sample.hpp"

namespace trundle::test {
namespace {

using Json = nlohmann::json;

const std::string kDemoFolder = std::string(TRUNDLE_SOURCE_DIR) + "/data/demo";

Outcome slam_of_tour(const Sample& sample, Arguments more) {
  more.insert(more.begin(),
              {"slam", kDemoFolder + "/session_01/tour", "--robot", kDemoFolder + "/robot.toml", "--quiet"});
  return run_program(sample.folder(), more);
}

TEST(Growth, EndsWithTheMapAndBeginsWithLess) {
  const Sample sample;
  ASSERT_EQ(slam_of_tour(sample, {"-o", "d"}).exit_code, 0);
  const report::Results results = report::read_results(sample.folder() / "d");
  ASSERT_EQ(results.growth.size(), 1U);
  const auto& snapshots = results.growth.front().snapshots;
  ASSERT_GE(snapshots.size(), 64U);
  EXPECT_LE(snapshots.size(), 129U);
  ASSERT_EQ(results.tracks.size(), 1U);
  const Trajectory& online = results.tracks.front().trajectory;
  EXPECT_EQ(snapshots.back().time_s, online.poses.back().time_s);
  EXPECT_EQ(snapshots.back().pose.x, online.poses.back().pose.x);
  EXPECT_EQ(snapshots.back().covariance(0, 0), online.covariances.back()(0, 0));
  const auto& map = snapshots.back().landmarks;
  ASSERT_EQ(map.size(), results.landmarks->size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    EXPECT_EQ(map[i].name, (*results.landmarks)[i].name);
    EXPECT_LT((map[i].position - (*results.landmarks)[i].position).norm(), 1e-3);
    EXPECT_LE(map[i].covariance->trace(), 1.05 * snapshots.front().landmarks[i].covariance->trace());
  }
  for (std::size_t i = 1; i < snapshots.size(); ++i) {
    EXPECT_GT(snapshots[i].time_s, snapshots[i - 1].time_s);
    EXPECT_LE(snapshots[i].path.size(), 201U);
  }
  EXPECT_EQ(results.growth.front().moved_m.size(), results.growth.front().moved_time_s.size());
}

TEST(Growth, WithAWindowThePathBeforeItIsThereToo) {
  const Sample sample;
  ASSERT_EQ(slam_of_tour(sample, {"--window", "10", "-o", "d"}).exit_code, 0);
  ASSERT_EQ(slam_of_tour(sample, {"-o", "whole"}).exit_code, 0);
  const auto windowed = report::read_results(sample.folder() / "d").growth.front().snapshots.back().path;
  const auto whole = report::read_results(sample.folder() / "whole").growth.front().snapshots.back().path;
  EXPECT_GT(windowed.size(), whole.size() / 2);
  EXPECT_LT((windowed.front() - whole.front()).norm(), 0.05);
}

TEST(Growth, IsTheSameAfterAResume) {
  const Sample sample;
  ASSERT_EQ(
      slam_of_tour(sample, {"--checkpoint", "state", "--checkpoint-every-s", "50", "-o", "d"}).exit_code, 0);
  ASSERT_EQ(slam_of_tour(sample, {"--resume", "state", "-o", "e"}).exit_code, 0);
  EXPECT_EQ(read_file(sample.folder() / "d/growth.json"), read_file(sample.folder() / "e/growth.json"));
}

TEST(Growth, FiltersThatKeepNoneLeaveNone) {
  const Sample sample;
  ASSERT_EQ(slam_of_tour(sample, {"-o", "d"}).exit_code, 0);
  ASSERT_EQ(slam_of_tour(sample, {"--filter", "ekf", "-o", "d"}).exit_code, 0);
  EXPECT_FALSE(std::filesystem::exists(sample.folder() / "d/growth.json"));
}

/// Each robot grows alone, and ends in the map of all.
TEST(Growth, OfSeveralRobotsBeginsWhereAllTogetherPlaceThem) {
  const Sample sample;
  const Arguments together = {"slam",
                              kDemoFolder + "/session_01/tour",
                              kDemoFolder + "/session_02/tour",
                              "--robot",
                              kDemoFolder + "/robot.toml",
                              "--together",
                              "--quiet",
                              "-o",
                              "d"};
  ASSERT_EQ(run_program(sample.folder(), together).exit_code, 0);
  const report::Results results = report::read_results(sample.folder() / "d");
  ASSERT_EQ(results.growth.size(), 2U);
  for (const report::GrowthResult& growth : results.growth) {
    const auto track = std::ranges::find(results.tracks, growth.robot, &report::ResultTrack::name);
    ASSERT_NE(track, results.tracks.end());
    const Pose2& start = track->trajectory.poses.front().pose;
    EXPECT_LT((growth.snapshots.front().path.front() - start.translation()).norm(), 0.02) << growth.robot;
    for (const report::LandmarkRow& landmark : growth.snapshots.back().landmarks) {
      const auto of_all = std::ranges::find(*results.landmarks, landmark.name, &report::LandmarkRow::name);
      ASSERT_NE(of_all, results.landmarks->end());
      EXPECT_LT((landmark.position - of_all->position).norm(), 0.3) << growth.robot << landmark.name;
    }
  }
  Arguments by_ekf = together;
  by_ekf.insert(by_ekf.end(), {"--filter", "ekf"});
  ASSERT_EQ(run_program(sample.folder(), by_ekf).exit_code, 0);
  EXPECT_THAT(report::read_results(sample.folder() / "d").growth, testing::IsEmpty());
}

}  // namespace
}  // namespace trundle::test
