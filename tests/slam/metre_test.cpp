// Lengths count in the metre of the sensor's ranges: what that is off by no sighting shows, and every pose is
// off by it.
#include "trundle/slam/models/metre.hpp"

#include <gtest/gtest.h>

#include "trundle/slam/models/systematic_errors.hpp"

namespace trundle::slam {
namespace {

constexpr double kSigma = 0.02;
const Metre kMetre{kSigma, {1.0, 2.0}};

TEST(Metre, MovesPlacesAlongTheWayFromTheStartAndNoHeading) {
  Trajectory trajectory{{{0.0, {1.0, 2.0, 0.3}}, {1.0, {4.0, 2.0, 0.6}}},
                        {Matrix3::Zero(), 1e-4 * Matrix3::Identity()}};
  kMetre.add_to(trajectory);
  EXPECT_TRUE(trajectory.covariances[0].isZero(0.0));
  const Matrix3 expected = Vector3(1e-4 + kSigma * kSigma * 9.0, 1e-4, 1e-4).asDiagonal();
  EXPECT_TRUE(trajectory.covariances[1].isApprox(expected, 1e-12));
}

/// Diameters known to 1e-5 m in the metre of ranges, which is known to 2 %.
Robot calibrated_by_landmarks(const Matrix2& in_that_metre) {
  Robot robot;
  robot.chassis = differential_drive({0.1, 4096.0, 0}, 0.3);
  robot.wheel_names = {"left", "right"};
  robot.landmark_sensor.emplace();
  robot.calibration.emplace();
  for (const Parameter& parameter :
       {Parameter{ParameterKind::diameter, 0}, Parameter{ParameterKind::diameter, 1}})
    robot.calibration->parameters.push_back(
        {.name = name_of(parameter, robot), .unit = "m", .observable = true});
  robot.calibration->parameters.push_back({.name = "sensor.range_scale", .unit = "1"});
  const Eigen::Vector3d by_scale(-0.1, -0.1, 1.0);
  Matrix3 covariance = kSigma * kSigma * by_scale * by_scale.transpose();
  covariance.topLeftCorner<2, 2>() += in_that_metre;
  robot.calibration->covariance = covariance;
  return robot;
}

TEST(Metre, IsWhatACalibrationSaysOfTheScaleOfRanges) {
  Robot robot = calibrated_by_landmarks(1e-10 * Matrix2::Identity());
  EXPECT_NEAR(metre_sigma(robot).value(), kSigma, 1e-15);
  robot.landmark_sensor->range_scale = 2.0;
  EXPECT_NEAR(metre_sigma(robot).value(), 0.5 * kSigma, 1e-15);
  robot.calibration.reset();
  EXPECT_FALSE(metre_sigma(robot).has_value());
}

TEST(Metre, WheelsCountInThatOfTheSensorUnlessAMapHasAnother) {
  Matrix2 in_that_metre;
  in_that_metre << 2e-10, 1e-10, 1e-10, 3e-10;
  const Robot robot = calibrated_by_landmarks(in_that_metre);
  const auto covariance = [&](LengthsIn lengths) -> Eigen::MatrixXd {
    const Eigen::MatrixXd L = systematic_errors_of(robot, false, lengths).by_component;
    return L * L.transpose();
  };
  EXPECT_TRUE(covariance(LengthsIn::sensor_metre).isApprox(in_that_metre, 1e-6));
  EXPECT_TRUE(
      covariance(LengthsIn::true_metre).isApprox(robot.calibration->covariance.topLeftCorner(2, 2), 1e-9));
}

}  // namespace
}  // namespace trundle::slam
