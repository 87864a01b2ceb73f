// Where a calibration leaves the scale of ranges open, all that is said of where the robot was allows for it,
// and nothing else changes.
#include <gtest/gtest.h>

#include "trundle/pipeline/slam_answer.hpp"
#include "trundle/pipeline/together_answer.hpp"

namespace trundle::pipeline {
namespace {

const std::filesystem::path kTours = std::filesystem::path(TRUNDLE_SOURCE_DIR) / "data/demo";

/// The demo's robot, with a calibration that knows the scale of ranges so well.
RobotFile robot_with_scale_sigma(std::optional<double> sigma) {
  RobotFile file = read_robot_file(kTours / "robot.toml");
  if (!sigma) return file;
  file.robot.calibration.emplace().parameters = {{.name = "sensor.range_scale", .unit = "1"}};
  file.robot.calibration->covariance = Eigen::MatrixXd::Constant(1, 1, *sigma * *sigma);
  return file;
}

SlamAnswer smoothed_by(const RobotFile& robot) {
  return answer_slam(read_recording(kTours / "session_01/tour"), robot,
                     {.start = {1.0, -2.0, 0.5}, .smooth = true});
}

/// That `open` has σ² v vᵀ more, v the way from the start.
void expect_more_by(double sigma, const Vector2& start, const Trajectory& open, const Trajectory& given) {
  ASSERT_EQ(open.poses.size(), given.poses.size());
  for (std::size_t k = 0; k < open.poses.size(); ++k) {
    const Vector2 off = sigma * (open.poses[k].pose.translation() - start);
    Matrix3 expected = given.covariances[k];
    expected.topLeftCorner<2, 2>() += off * off.transpose();
    ASSERT_EQ(open.poses[k].pose.translation(), given.poses[k].pose.translation()) << k;
    ASSERT_TRUE(open.covariances[k].isApprox(expected, 1e-12)) << k;
  }
}

TEST(OpenMetre, OfOneRobotIsInItsPath) {
  const SlamAnswer open = smoothed_by(robot_with_scale_sigma(0.02)),
                   given = smoothed_by(robot_with_scale_sigma({}));
  EXPECT_EQ(open.metre_sigma, 0.02);
  EXPECT_EQ(given.metre_sigma, 0.0);
  const Vector2 start(1.0, -2.0);
  expect_more_by(0.02, start, open.smoothed->trajectory, given.smoothed->trajectory);
  EXPECT_EQ(open.smoothed->map_covariance, given.smoothed->map_covariance);
  expect_more_by(0.02, start, open.result.online, given.result.online);
  EXPECT_EQ(open.result.map_covariance, given.result.map_covariance);
}

TEST(OpenMetre, OfTwoRobotsIsInBothAndHalfInTheMeanSquare) {
  const auto together_by = [](std::optional<double> sigma, std::optional<double> other) {
    const RobotFile robot = robot_with_scale_sigma(sigma), second = robot_with_scale_sigma(other);
    return answer_together({{read_recording(kTours / "session_01/tour"), robot},
                            {read_recording(kTours / "session_02/tour"), second}},
                           {});
  };
  // Without a calibration 2 % is taken for granted beside one that says it of another robot.
  const TogetherAnswer open = together_by(0.02, {}), given = together_by({}, {});
  EXPECT_NEAR(open.metre_sigma, 0.02 / std::sqrt(2.0), 1e-12);
  EXPECT_EQ(given.metre_sigma, 0.0);
  for (std::size_t i = 0; i < 2; ++i)
    expect_more_by(0.02 / std::sqrt(2.0), Vector2::Zero(), open.joint.robots[i].trajectory,
                   given.joint.robots[i].trajectory);
  EXPECT_EQ(open.joint.map_covariance, given.joint.map_covariance);
}

}  // namespace
}  // namespace trundle::pipeline
