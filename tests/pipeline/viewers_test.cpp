// What viewers read of results, by this project's own readers of logs; tools/compare_logs.sh does it by
// others'.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/io/error.hpp"
#include "trundle/pipeline/viewers/shown.hpp"
#include "trundle/pipeline/viewers/writers.hpp"

#include "logs/read_log.hpp"
#include "scale.hpp"

namespace trundle::test {
using namespace pipeline;
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

/// One metre a second ahead, and left by a quarter turn in the third second.
Trajectory corner() {
  Trajectory trajectory;
  trajectory.poses = {{10.0, {0.0, 0.0, 0.0}},
                      {11.0, {1.0, 0.0, 0.0}},
                      {12.5, Pose2{1.0, 0.0, 0.0} * exp(Twist2{1.0, 0.0, 0.5 * kPi})}};
  for (const double sigma : {0.0, 0.1, 0.2}) {
    Matrix3 covariance = Matrix3::Identity() * sigma * sigma;
    covariance(0, 1) = covariance(1, 0) = 0.5 * sigma * sigma;
    covariance(1, 2) = covariance(2, 1) = -0.25 * sigma * sigma;
    trajectory.covariances.push_back(covariance);
  }
  return trajectory;
}

const std::vector<ShownSlip> kSlips = {{{.start_s = 10.5,
                                         .end_s = 11.0,
                                         .wheel = 0,
                                         .kind = SlipKind::spin,
                                         .excess_m = 0.25,
                                         .excess_sigma_m = 0.01,
                                         .confidence = 0.9},
                                        "left"},
                                       {{.start_s = 11.0,
                                         .end_s = 11.5,
                                         .wheel = 0,
                                         .kind = SlipKind::skid,
                                         .excess_m = -0.5,
                                         .excess_sigma_m = 0.02,
                                         .confidence = 0.8},
                                        "left"}};

std::string bytes_of(ViewerFormat format, const Shown& all) {
  std::string bytes;
  viewer_file("f", format, all).rest([&](std::string_view piece) { bytes += piece; });
  return bytes;
}

std::vector<std::string> lines_of(const std::string& bytes, const std::string& topic) {
  const LogContent content = read_log(bytes);
  EXPECT_FALSE(content.cut);
  std::vector<std::string> lines;
  for (const std::string& line : content.lines)
    if (line.find(" " + topic + ": ") != std::string::npos) lines.push_back(line);
  return lines;
}

TEST(ViewersMcap, OdometryHasPoseCovarianceAndTwist) {
  const Trajectory trajectory = corner();
  const std::string bytes = bytes_of(
      ViewerFormat::mcap,
      {.provenance = {}, .time_origin_s = 1'700'000'000, .trajectories = {shown("slam online", trajectory)}});
  const std::vector<std::string> lines = lines_of(bytes, "/trundle/slam_online");
  ASSERT_EQ(lines.size(), 3);
  EXPECT_THAT(lines[0],
              AllOf(StartsWith("1700000010000000 "), HasSubstr("header.frame_id='map'"),
                    HasSubstr("child_frame_id='slam_online/base_link'"), HasSubstr("twist.linear.x=0 ")));
  EXPECT_THAT(
      lines[1],
      AllOf(HasSubstr("twist.twist.linear.x=1 "), HasSubstr("twist.twist.angular.z=0 "),
            HasSubstr("pose.pose.position.x=1 "), HasSubstr("pose.pose.orientation.w=1 "),
            // rows and columns: x, y, z and the rotations about them
            HasSubstr("pose.covariance[0]=0.010000000000000002 pose.covariance[1]=0.005000000000000001 "
                      "pose.covariance[2]=0 "),
            HasSubstr("pose.covariance[11]=-0.0025000000000000005 "),
            HasSubstr("pose.covariance[35]=0.010000000000000002 "), HasSubstr("pose.covariance[14]=0 "),
            HasSubstr("twist.covariance[0]=0 ")));
  const double rate = 1.0 / 1.5;
  EXPECT_THAT(lines[2], AllOf(HasSubstr(fmt::format("orientation.z={}", std::sin(0.25 * kPi))),
                              HasSubstr(fmt::format("linear.x={}", rate).substr(0, 14)),
                              HasSubstr(fmt::format("angular.z={}", 0.5 * kPi * rate).substr(0, 14))));
}

TEST(ViewersMcap, FramesMoveAlongAndThePathIsThereFromTheStart) {
  const Trajectory trajectory = corner();
  const std::string bytes =
      bytes_of(ViewerFormat::mcap, {.provenance = {}, .trajectories = {shown("slam", trajectory)}});
  const std::vector<std::string> frames = lines_of(bytes, "/tf");
  ASSERT_EQ(frames.size(), 3);
  EXPECT_THAT(frames[1], AllOf(StartsWith("11000000 "), HasSubstr("transforms[0].header.stamp=11000000000"),
                               HasSubstr("transforms[0].child_frame_id='slam/base_link'"),
                               HasSubstr("transforms[0].transform.translation.x=1 ")));
  const std::vector<std::string> path = lines_of(bytes, "/trundle/slam/path");
  ASSERT_EQ(path.size(), 1);
  EXPECT_THAT(path[0], AllOf(StartsWith("10000000 "), HasSubstr("poses[2].header.stamp=12500000000"),
                             HasSubstr("poses[1].pose.position.x=1 ")));
}

/// χ² of two degrees of freedom: 95 % lie within √5.991 sigmas.
TEST(ViewersMcap, EllipsesHold95Percent) {
  const Trajectory trajectory = corner();
  const std::string bytes =
      bytes_of(ViewerFormat::mcap, {.provenance = {},
                                    .trajectories = {shown("slam", trajectory)},
                                    .landmarks = {{.name = "tree", .position = {2.0, 3.0}}}});
  const std::vector<std::string> ellipses = lines_of(bytes, "/trundle/slam/ellipses");
  ASSERT_EQ(ellipses.size(), 1);
  const auto beginning = [](double number) { return fmt::format("{:.14f}", number).substr(0, 11); };
  // Of variances 0.01 and a correlation of 1/2 the axes are √0.015 and √0.005, the longer at 45°.
  const double half = std::sqrt(5.991464547107979);
  EXPECT_THAT(ellipses[0],
              AllOf(HasSubstr("markers[0].action=3 "), HasSubstr("markers[2].type=2 "),
                    HasSubstr("markers[2].scale.x=" + beginning(2.0 * half * std::sqrt(0.015))),
                    HasSubstr("markers[2].scale.y=" + beginning(2.0 * half * std::sqrt(0.005))),
                    HasSubstr("markers[2].pose.orientation.z=" + beginning(std::sin(kPi / 8.0)))));
  const std::vector<std::string> landmarks = lines_of(bytes, "/trundle/landmarks");
  ASSERT_EQ(landmarks.size(), 1);
  EXPECT_THAT(landmarks[0], AllOf(HasSubstr("markers[1].pose.position.y=3 "), HasSubstr("markers[2].type=9 "),
                                  HasSubstr("markers[2].text='tree'"), HasSubstr("markers[2].id=2 ")));
}

TEST(ViewersMcap, SlipsAreDiagnosticsThatBeginAndEnd) {
  const Trajectory trajectory = corner();
  const std::vector<std::string> slips =
      lines_of(bytes_of(ViewerFormat::mcap,
                        {.provenance = {}, .trajectories = {shown("slam", trajectory)}, .slips = kSlips}),
               "/trundle/slips");
  ASSERT_EQ(slips.size(), 4);
  EXPECT_THAT(slips[0],
              AllOf(StartsWith("10500000 "),
                    HasSubstr("status[0].level=1 status[0].name='slip: left' "
                              "status[0].message='spin'"),
                    HasSubstr("status[0].values[0].key='excess_m' status[0].values[0].value='0.25'")));
  // One ends where the next begins: it does not end that one.
  EXPECT_THAT(slips[1], AllOf(StartsWith("11000000 "), HasSubstr("status[0].level=0 ")));
  EXPECT_THAT(slips[2], AllOf(StartsWith("11000000 "), HasSubstr("status[0].message='skid'")));
}

TEST(ViewersMcap, OfALongPathAPictureIsKeptAndEveryPose) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  Trajectory trajectory;
  for (int i = 0; i < 20'000; ++i) {
    trajectory.poses.push_back({0.02 * i, {0.01 * i, 0.0, 0.0}});
    trajectory.covariances.push_back(Matrix3::Identity() * 1e-6 * i);
  }
  const std::string bytes =
      bytes_of(ViewerFormat::mcap, {.provenance = {}, .trajectories = {shown("slam", trajectory)}});
  EXPECT_EQ(lines_of(bytes, "/trundle/slam").size(), 20'000);
  const std::vector<std::string> path = lines_of(bytes, "/trundle/slam/path");
  EXPECT_THAT(path, ElementsAre(AllOf(HasSubstr("poses[4000].pose"), HasSubstr("pose.position.x=199.99 "),
                                      testing::Not(HasSubstr("poses[8001].pose")))));
  EXPECT_THAT(
      lines_of(bytes, "/trundle/slam/ellipses"),
      ElementsAre(AllOf(HasSubstr("markers[50].pose"), testing::Not(HasSubstr("markers[101].pose")))));
}

TEST(ViewersMcap, WithoutCovarianceThereAreNoEllipses) {
  Trajectory trajectory = corner();
  trajectory.covariances.clear();
  const std::string bytes =
      bytes_of(ViewerFormat::mcap, {.provenance = {}, .trajectories = {shown("slam path", trajectory)}});
  EXPECT_THAT(lines_of(bytes, "/trundle/slam_path"), testing::SizeIs(3));
  EXPECT_THAT(lines_of(bytes, "/trundle/slam_path/ellipses"), testing::IsEmpty());
}

TEST(Viewers, TimesBeforeTheirClockAreRefused) {
  Trajectory trajectory = corner();
  trajectory.poses[0].time_s = -0.5;
  for (const ViewerFormat format : {ViewerFormat::mcap, ViewerFormat::wpilog})
    EXPECT_THROW((void)bytes_of(format, {.provenance = {}, .trajectories = {shown("a", trajectory)}}),
                 CannotAnswer);
}

TEST(Viewers, SameResultsAreTheSameBytes) {
  const Trajectory trajectory = corner();
  const Shown all{.provenance = {.inputs = {{"a.csv", "00"}}, .options = {{"start", "0,0,0"}}, .seed = 7},
                  .trajectories = {shown("slam", trajectory)},
                  .slips = kSlips};
  for (const ViewerFormat format : {ViewerFormat::mcap, ViewerFormat::wpilog}) {
    const std::string bytes = bytes_of(format, all);
    EXPECT_EQ(bytes, bytes_of(format, all));
    EXPECT_THAT(bytes, AllOf(HasSubstr("a.csv"), HasSubstr("\"seed\"")));
  }
}

TEST(ViewersWpilog, HasPosesAsWpilibSerializesThem) {
  const Trajectory trajectory = corner();
  const std::string bytes =
      bytes_of(ViewerFormat::wpilog, {.provenance = {},
                                      .trajectories = {shown("slam", trajectory)},
                                      .landmarks = {{.name = "tree", .position = {2.0, 3.0}}},
                                      .slips = kSlips});
  EXPECT_THAT(lines_of(bytes, "/Trundle/slam/Pose"),
              Contains("11000000 /Trundle/slam/Pose: translation.x=1 translation.y=0 rotation.value=0"));
  EXPECT_THAT(lines_of(bytes, "/Trundle/slam/Sigma"),
              Contains("12500000 /Trundle/slam/Sigma: value[0]=0.2 value[1]=0.2 value[2]=0.2"));
  EXPECT_THAT(lines_of(bytes, "/Trundle/slam/Covariance"), testing::SizeIs(3));
  EXPECT_THAT(lines_of(bytes, "/Trundle/slam/Path"),
              ElementsAre(AllOf(StartsWith("10000000 "), HasSubstr("value[1].translation.x=1 "),
                                HasSubstr("value[2].rotation.value="))));
  EXPECT_THAT(lines_of(bytes, "/Trundle/Landmarks/Positions"),
              ElementsAre("10000000 /Trundle/Landmarks/Positions: value[0].x=2 value[0].y=3"));
  EXPECT_THAT(lines_of(bytes, "/Trundle/Landmarks/Names"),
              ElementsAre("10000000 /Trundle/Landmarks/Names: value[0]='tree'"));
  EXPECT_THAT(lines_of(bytes, "/Trundle/Slip/left/Kind"),
              ElementsAre("10000000 /Trundle/Slip/left/Kind: value='none'",
                          "10500000 /Trundle/Slip/left/Kind: value='spin'",
                          "11000000 /Trundle/Slip/left/Kind: value='none'",
                          "11000000 /Trundle/Slip/left/Kind: value='skid'",
                          "11500000 /Trundle/Slip/left/Kind: value='none'"));
}

}  // namespace
}  // namespace trundle::test
