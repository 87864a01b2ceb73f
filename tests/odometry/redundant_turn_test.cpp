// What wheels tell of the gyro's bias where nothing rests. docs/theory/redundant-turn.md.

#include <gtest/gtest.h>

#include "trundle/geometry/squared.hpp"
#include "trundle/odometry/uncertain.hpp"
#include "trundle/statistics/distribution.hpp"

#include "odometry/sensed_drive.hpp"
#include "scale.hpp"

namespace trundle::odometry {
namespace {

using test::Piece;
using test::SensedDrive;

constexpr double kNoise =
    0.002;  // of a wheel [√m]: headings stay within some degrees, where first order holds
constexpr double kBiasSigma = 0.02;
constexpr double kDrive_s = 30.0;

Robot nominal_robot(double ticks_per_revolution) {
  Robot robot = test::robot_of(
      differential_drive({.diameter_m = 0.1, .ticks_per_revolution = ticks_per_revolution}, 0.3));
  robot.chassis.gyro = test::kGyro;
  robot.chassis.gyro->bias_sigma_rad_s = kBiasSigma;
  set_typical_wheel_noise(kNoise, robot.chassis);
  return robot;
}

/// Of the diameters, the track and the gyro's scale: 0.3 % each, the diameters alike to 0.8.
Robot calibrated(Robot robot) {
  CalibrationRecord calibration;
  calibration.covariance.setZero(4, 4);
  int i = 0;
  for (const Parameter& parameter :
       {Parameter{ParameterKind::diameter, 0}, Parameter{ParameterKind::diameter, 1},
        Parameter{ParameterKind::track}, Parameter{ParameterKind::gyro_scale}}) {
    CalibratedParameter& one = calibration.parameters.emplace_back();
    one.name = name_of(parameter, robot);
    one.value = value_of(parameter, robot);
    one.observable = true;
    calibration.covariance(i, i) = squared(0.003 * one.value);
    ++i;
  }
  calibration.covariance(0, 1) = calibration.covariance(1, 0) = 0.8 * calibration.covariance(0, 0);
  robot.calibration = calibration;
  return robot;
}

/// What it may really be: parameters as its calibration has them, bias as its gyro has it.
Robot drawn(const Robot& robot, Random& random) {
  Robot truth = robot;
  const UncertainParameters uncertain = uncertain_parameters(robot, true);
  const Eigen::MatrixXd root = uncertain.covariance.llt().matrixL();
  Eigen::VectorXd unit(root.cols());
  for (double& u : unit) u = random.normal();
  const Eigen::VectorXd change = root * unit;
  for (std::size_t i = 0; i < uncertain.parameters.size(); ++i) {
    const Parameter& parameter = uncertain.parameters[i];
    set_value(parameter, value_of(parameter, robot) + change[static_cast<int>(i)], truth);
  }
  truth.chassis.gyro->bias_rad_s = random.normal(kBiasSigma);
  return truth;
}

std::vector<Piece> drive_without_rest(double duration_s, Random& random) {
  std::vector<Piece> pieces;
  for (double t = 0.0; t < duration_s; t += pieces.back().duration_s)
    pieces.push_back(
        {1.0 + 3.0 * random.uniform(), 0.1 + 0.4 * random.uniform(), 1.6 * random.uniform() - 0.8});
  return pieces;
}

Pose2 driven(const std::vector<Piece>& pieces) {
  Pose2 pose;
  for (const Piece& piece : pieces)
    pose = pose * exp(Twist2{piece.forward_m_s * piece.duration_s, 0.0, piece.turn_rad_s * piece.duration_s});
  return pose;
}

struct Squares {
  double bias = 0.0;
  double pose = 0.0;  ///< NEES
  double heading_sigma = 0.0;
};

/// At the end of one drive, errors over what was stated of them.
Squares one_drive(const Robot& robot, double rate_hz, std::uint64_t seed) {
  Random random(seed, 7);
  const Robot truth = drawn(robot, random);
  std::vector<Piece> pieces = drive_without_rest(kDrive_s, random);
  for (Piece& piece : pieces) piece.duration_s = std::round(piece.duration_s * rate_hz) / rate_hz;
  SensedDrive drive(truth, rate_hz, seed);
  drive.wheel_noise_per_sqrt_m = kNoise;
  const UncertainParameters uncertain = uncertain_parameters(robot, true);
  Odometer odometer(robot, {.parameters = uncertain.parameters, .learn_gyro_bias = true});
  for (const Increment& increment : drive.over(pieces)) odometer.step(increment);
  const GyroBias bias = odometer.gyro_bias();
  const Pose2 real = driven(pieces);
  const Vector3 error(odometer.pose().x - real.x, odometer.pose().y - real.y,
                      odometer.pose().heading - real.heading);
  const Matrix3 covariance = total_covariance(odometer, uncertain.covariance);
  return {squared(bias.rad_s - drive.bias_rad_s()) / bias.variance, error.dot(covariance.llt().solve(error)),
          std::sqrt(covariance(2, 2))};
}

class WithoutRest : public testing::TestWithParam<std::pair<double, double>> {};

// The wheels of a calibrated robot tell the bias, and what is stated of it and of the pose holds.
TEST_P(WithoutRest, WheelsTellTheBiasAndWhatIsStatedHolds) {
  const auto [rate_hz, ticks] = GetParam();
  const Robot robot = calibrated(nominal_robot(ticks));
  const int drives = test::trials(100, 20);
  double bias = 0.0, pose = 0.0, heading_sigma = 0.0;
  for (int seed = 0; seed < drives; ++seed) {
    const Squares squares = one_drive(robot, rate_hz, static_cast<std::uint64_t>(seed));
    bias += squares.bias, pose += squares.pose, heading_sigma += squares.heading_sigma / drives;
  }
  const double n = drives;
  EXPECT_LT(bias, chi_squared_limit(1e-3, n));
  EXPECT_GT(bias, chi_squared_limit(1.0 - 1e-3, n));
  EXPECT_LT(pose, chi_squared_limit(1e-3, 3.0 * n));
  EXPECT_LT(heading_sigma, 0.2 * kBiasSigma * kDrive_s);  // a fifth of what the bias would have left of it
}

INSTANTIATE_TEST_SUITE_P(RatesAndCounts, WithoutRest,
                         testing::Values(std::pair{10.0, 1000.0}, std::pair{20.0, 60.0},
                                         std::pair{100.0, 4000.0}, std::pair{50.0, 500.0}));

// Nobody said how right its track and its diameters are: on an even way the difference may all be theirs.
TEST(RedundantTurn, WheelsOfUnknownSizeTellNothingOnAnEvenWay) {
  const Robot robot = nominal_robot(1000.0);
  SensedDrive drive(test::with_bias(robot, 0.01), 20.0, 1);
  Odometer odometer = test::learning(robot);
  for (const Increment& increment : drive.over({{60.0, 0.3, 0.2}})) odometer.step(increment);
  EXPECT_GT(std::sqrt(odometer.gyro_bias().variance), 0.9 * kBiasSigma);
}

TEST(RedundantTurn, ASlipIsForgotten) {
  const Robot robot = calibrated(nominal_robot(1000.0));
  SensedDrive drive(test::with_bias(robot, 0.01), 50.0, 2);
  drive.wheel_noise_per_sqrt_m = kNoise;
  Odometer odometer = test::learning(robot);
  for (const Increment& increment : drive.over({{30.0, 0.3, 0.2}})) odometer.step(increment);
  drive.encoder_gain[0] = 2.0;  // spins for half a second: 15 cm that the robot did not drive
  for (const Increment& increment : drive.over({{0.5, 0.3, 0.2}})) odometer.step(increment);
  drive.encoder_gain[0] = 1.0;
  for (const Increment& increment : drive.over({{30.0, 0.3, 0.2}})) odometer.step(increment);
  const GyroBias bias = odometer.gyro_bias();
  EXPECT_NEAR(bias.rad_s, drive.bias_rad_s(), 3.0 * std::sqrt(bias.variance));
  EXPECT_LT(std::sqrt(bias.variance), 0.2 * kBiasSigma);
}

}  // namespace
}  // namespace trundle::odometry
