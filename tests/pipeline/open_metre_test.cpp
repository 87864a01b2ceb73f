// Where a calibration leaves the scale of ranges open, all that is said of places allows for it, and nothing
// else changes.
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

void expect_more_by(double sigma, const Vector2& start, const std::vector<MappedLandmark>& map,
                    const Eigen::MatrixXd& open, const Eigen::MatrixXd& given) {
  ASSERT_FALSE(map.empty());
  Eigen::VectorXd off(open.rows());
  for (std::size_t i = 0; i < map.size(); ++i)
    off.segment<2>(2 * static_cast<Eigen::Index>(i)) = sigma * (map[i].position - start);
  EXPECT_TRUE(open.isApprox(given + off * off.transpose(), 1e-12));
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto at = 2 * static_cast<Eigen::Index>(i);
    EXPECT_TRUE((map[i].covariance.isApprox(open.block<2, 2>(at, at), 1e-9))) << i;
  }
}

TEST(OpenMetre, OfOneRobotIsInPathAndMap) {
  const SlamAnswer open = smoothed_by(robot_with_scale_sigma(0.02)),
                   given = smoothed_by(robot_with_scale_sigma({}));
  EXPECT_EQ(open.metre_sigma, 0.02);
  EXPECT_EQ(given.metre_sigma, 0.0);
  const Vector2 start(1.0, -2.0);
  expect_more_by(0.02, start, open.smoothed->trajectory, given.smoothed->trajectory);
  expect_more_by(0.02, start, open.smoothed->map, open.smoothed->map_covariance,
                 given.smoothed->map_covariance);
  expect_more_by(0.02, start, open.result.online, given.result.online);
  expect_more_by(0.02, start, open.result.map, open.result.map_covariance, given.result.map_covariance);
}

TEST(OpenMetre, OfSeveralIsInAllAndHalfAsFarOffInTheMeanSquareOfTwo) {
  const auto together_by = [](std::optional<double> sigma) {
    const RobotFile robot = robot_with_scale_sigma(sigma);
    return answer_together({{read_recording(kTours / "session_01/tour"), robot},
                            {read_recording(kTours / "session_02/tour"), robot}},
                           {});
  };
  const TogetherAnswer open = together_by(0.02),
                       given = together_by({});  // of which 2 % is taken for granted
  for (std::size_t i = 0; i < 2; ++i)
    expect_more_by(0.02 / std::sqrt(2.0), Vector2::Zero(), open.joint.robots[i].trajectory,
                   given.joint.robots[i].trajectory);
  expect_more_by(0.02 / std::sqrt(2.0), Vector2::Zero(), open.joint.map, open.joint.map_covariance,
                 given.joint.map_covariance);
}

}  // namespace
}  // namespace trundle::pipeline
