#include <cmath>

#include <gtest/gtest.h>

#include "trundle/evaluation/evaluate.hpp"
#include "trundle/statistics/random.hpp"

namespace trundle::evaluation {
namespace {

Robot robot_with_sensor() {
  Robot robot;
  robot.body_from_reference = {0.3, -0.2, 0.4};
  robot.reference_time_offset_s = 0.05;
  return robot;
}

TEST(ReferenceSensor, PoseAndClockAreItsOwn) {
  const Trajectory body{{{10.0, {1.0, 2.0, 0.5 * kPi}}}, {}};
  const Trajectory sensor = of_reference_sensor(body, robot_with_sensor());
  EXPECT_NEAR(sensor.poses[0].time_s, 9.95, 1e-12);  // its stamps plus the offset are the robot's
  EXPECT_NEAR(sensor.poses[0].pose.x, 1.2, 1e-12);
  EXPECT_NEAR(sensor.poses[0].pose.y, 2.3, 1e-12);
  EXPECT_NEAR(sensor.poses[0].pose.heading, 0.5 * kPi + 0.4, 1e-12);
}

TEST(ReferenceSensor, CovarianceIsThatOfManyDisturbedBodies) {
  const Vector3 sigma(0.02, 0.01, 0.05);
  const Pose2 body{1.0, 2.0, 0.7};
  const Trajectory one{{{0.0, body}}, {Matrix3(sigma.cwiseAbs2().asDiagonal())}};
  const Trajectory moved = of_reference_sensor(one, robot_with_sensor());
  Random random(6);
  Matrix3 scatter = Matrix3::Zero();
  constexpr int n = 20000;
  for (int i = 0; i < n; ++i) {
    const Pose2 disturbed{body.x + sigma.x() * random.normal(), body.y + sigma.y() * random.normal(),
                          body.heading + sigma.z() * random.normal()};
    const Pose2 sensor = of_reference_sensor({{{0.0, disturbed}}, {}}, robot_with_sensor()).poses[0].pose;
    const Pose2& mean = moved.poses[0].pose;
    const Vector3 e(sensor.x - mean.x, sensor.y - mean.y, sensor.heading - mean.heading);
    scatter += e * e.transpose() / n;
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const double scale = std::sqrt(moved.covariances[0](i, i) * moved.covariances[0](j, j));
      EXPECT_NEAR(scatter(i, j), moved.covariances[0](i, j), 4.0 * scale * std::sqrt(2.0 / n) + 1e-5);
    }
}

TEST(ReferenceStream, PositionsRemainWhereHeadingsWereNotMeasured) {
  ReferenceStream stream;
  stream.time_s = {0.0, 1.0, 2.0};
  stream.x_m = {1.0, kNotMeasured, 3.0};
  stream.y_m = {4.0, 5.0, 6.0};
  stream.heading_rad = {0.1, 0.2, kNotMeasured};
  const Trajectory positions = positions_of(stream);
  ASSERT_EQ(positions.poses.size(), 2u);
  EXPECT_EQ(positions.poses[0].pose.heading, 0.1);
  EXPECT_EQ(positions.poses[1].time_s, 2.0);
  EXPECT_TRUE(std::isnan(positions.poses[1].pose.heading));
}

}  // namespace
}  // namespace trundle::evaluation
