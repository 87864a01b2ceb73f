#include "trundle/recording/trajectory_file.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"

#include "recording/folder.hpp"

namespace trundle::recording {
namespace {

Trajectory tour(bool with_covariance) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> step(-0.2, 0.4);
  Trajectory trajectory;
  Pose2 pose;
  for (int i = 0; i < 200; ++i) {
    pose = pose * exp({step(random), step(random), step(random)});
    trajectory.poses.push_back({0.1 * i, pose});
    const Matrix3 root = Matrix3::NullaryExpr([&] { return step(random); });
    if (with_covariance) trajectory.covariances.emplace_back(root * root.transpose());
  }
  return trajectory;
}

TEST(TrajectoryFile, csv_reads_back_to_the_last_bit) {
  const test::Folder folder;
  for (const bool with_covariance : {true, false}) {
    const Trajectory written = tour(with_covariance);
    const Trajectory read = read_trajectory(folder.write("trajectory.csv", "# trundle\n" + to_csv(written)));
    ASSERT_EQ(read.poses.size(), written.poses.size());
    ASSERT_EQ(read.covariances.size(), written.covariances.size());
    for (std::size_t i = 0; i < read.poses.size(); ++i) {
      EXPECT_EQ(read.poses[i].time_s, written.poses[i].time_s);
      EXPECT_EQ(read.poses[i].pose.x, written.poses[i].pose.x);
      EXPECT_EQ(read.poses[i].pose.y, written.poses[i].pose.y);
      EXPECT_EQ(read.poses[i].pose.heading, written.poses[i].pose.heading);
      if (with_covariance) {
        for (const auto& [row, column] : {std::pair{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}}) {
          EXPECT_EQ(read.covariances[i](row, column), written.covariances[i](row, column));
          EXPECT_EQ(read.covariances[i](column, row), written.covariances[i](row, column));
        }
      }
    }
  }
}

TEST(TrajectoryFile, csv_has_the_columns_that_others_read) {
  const std::string text = to_csv({{{0.5, {1, 2, 3}}}, {Matrix3::Identity()}});
  EXPECT_EQ(text,
            "time_s,x_m,y_m,heading_rad,var_xx,var_xy,var_xh,var_yy,var_yh,var_hh\n0.5,1,2,3,1,0,0,1,0,1\n");
  EXPECT_EQ(to_csv({{{0.5, {1, 2, 3}}}, {}}), "time_s,x_m,y_m,heading_rad\n0.5,1,2,3\n");
}

TEST(TrajectoryFile, tum_reads_back_headings_made_continuous) {
  const test::Folder folder;
  const Trajectory written = tour(false);
  const Trajectory read = read_trajectory(folder.write("trajectory.tum", to_tum(written)));
  ASSERT_EQ(read.poses.size(), written.poses.size());
  const double turns = std::round((read.poses[0].pose.heading - written.poses[0].pose.heading) / (2.0 * kPi));
  EXPECT_GT(std::abs(written.poses.back().pose.heading), 2.0 * kPi);
  for (std::size_t i = 0; i < read.poses.size(); ++i) {
    EXPECT_EQ(read.poses[i].time_s, written.poses[i].time_s);
    EXPECT_EQ(read.poses[i].pose.x, written.poses[i].pose.x);
    EXPECT_NEAR(read.poses[i].pose.heading - 2.0 * kPi * turns, written.poses[i].pose.heading, 1e-12);
  }
}

TEST(TrajectoryFile, tum_has_eight_columns) {
  EXPECT_EQ(to_tum({{{0.5, {1, 2, 0}}}, {}}), "0.5 1 2 0 0 0 0 1\n");
}

TEST(TrajectoryFile, a_covariance_that_is_none_is_refused_at_its_row) {
  const test::Folder folder;
  const std::string head = "time_s,x_m,y_m,heading_rad,var_xx,var_xy,var_xh,var_yy,var_yh,var_hh\n";
  for (const char* covariance :
       {"nan,0,0,1,0,1", "-1e-9,0,0,1,0,1", "1,2,0,1,0,1", "1,0,0,1,,1", "1,0,0,1,0,inf"})
    try {
      (void)read_trajectory(
          folder.write("t.csv", head + "0,1,2,3,1,0,0,1,0,1\n0.1,1,2,3," + covariance + "\n"));
      ADD_FAILURE() << covariance;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("t.csv:3")) << covariance;
    }
}

TEST(TrajectoryFile, a_reference_without_any_heading_is_one_of_positions) {
  const test::Folder folder;
  const Trajectory read =
      read_trajectory(folder.write("reference.csv", "time_s,x_m,y_m,heading_rad\n0,1,2,\n1,,3,\n2,4,5,\n"));
  ASSERT_EQ(read.poses.size(), 2U);
  EXPECT_EQ(read.poses[1].pose.x, 4.0);
  EXPECT_TRUE(std::isnan(read.poses[1].pose.heading));
  EXPECT_FALSE(read.has_covariance());
}

TEST(TrajectoryFile, reference_csv_leaves_out_incomplete_poses) {
  const test::Folder folder;
  const Trajectory read = read_trajectory(
      folder.write("reference.csv", "time_s,x_m,y_m,heading_rad\n0,1,2,3.1\n0.1,,2,3.1\n0.2,1,2,-3.1\n"));
  ASSERT_EQ(read.poses.size(), 2U);
  EXPECT_NEAR(read.poses[1].pose.heading, 2.0 * kPi - 3.1, 1e-12);
}

}  // namespace
}  // namespace trundle::recording
