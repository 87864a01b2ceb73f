// A velocity that somebody else computed: its scales, its turn per metre and its bias, from a reference and
// from relative motions.
#include <cmath>

#include <Eigen/Cholesky>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/likelihood/relative_likelihood.hpp"
#include "trundle/calibration/likelihood/relative_table.hpp"
#include "trundle/calibration/preparation/velocity_lag.hpp"
#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/recording/velocity_lag.hpp"
#include "trundle/statistics/distribution.hpp"

#include "calibration/velocity_runs.hpp"
#include "recording/lagging_drive.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using test::kVelocityParameters;
using test::nominal_velocity;
using test::true_velocity;

Scenario velocity_scenario(const Robot& truth, std::uint64_t seed, double length_m) {
  Random random(seed, 42);
  Scenario scenario = test::scenario_of(
      nominal_velocity(), truth,
      random_tour({.length_m = length_m, .box_x_m = 5.0, .box_y_m = 5.0}, {}, random), seed);
  scenario.encoders.rate_hz = 10.0;
  return scenario;
}

Recording velocity_recording(const Robot& truth, std::uint64_t seed, double length_m = 30.0) {
  Recording recording = simulate(velocity_scenario(truth, seed, length_m)).recording;
  recording.name = "tour";
  recording.session = "one";
  return recording;
}

/// What the velocity reads beside what a sensor saw over each of its intervals, to a millimetre.
Recording with_relative_motions(const Robot& truth, std::uint64_t seed) {
  Recording recording = velocity_recording(truth, seed);
  recording.reference = {};
  const Increments increments = align(recording, truth).increments;
  const Rows rows = rows_of(truth.chassis, false);
  Random random(seed, 43);
  for (std::size_t i = 0; i < increments.size(); ++i) {
    const Increment increment = increments[i];
    Pose2 moved = exp(twist_of(truth.chassis, rows, increment));
    moved.x += random.normal(0.001);
    moved.y += random.normal(0.001);
    moved.heading += random.normal(0.001);
    recording.relative_motions.push_back(
        {.start_s = increment.time_s - increment.duration_s, .end_s = increment.time_s, .motion = moved});
  }
  return recording;
}

using test::VelocityEvidence;

TEST(VelocityCalibration, FindsTheTruthFromAReferenceWithinItsOwnSigmas) {
  VelocityEvidence evidence;
  for (int seed = 1; seed <= test::trials(60, 3); ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    const Robot truth = true_velocity(s);
    std::vector<calibration::Run> runs =
        test::prepared(nominal_velocity(), truth, test::differential_paths(), s);
    const std::vector<Parameter> parameters(kVelocityParameters.begin(), kVelocityParameters.end());
    EXPECT_EQ(default_parameters(nominal_velocity(), from_outside(runs)), parameters);
    const Estimate estimate = estimate_parameters({runs, nominal_velocity(), parameters});
    evidence.add(estimate.robot, estimate.covariance, truth);
  }
  evidence.expect_consistent();
}

TEST(VelocityCalibration, FindsTheTruthFromRelativeMotions) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Robot truth = true_velocity(seed);
    const Recording recording = with_relative_motions(truth, seed);
    const CalibrationResult result = calibrate({&recording, 1}, {}, nominal_velocity());
    for (const ParameterEstimate& e : result.parameters) {
      EXPECT_TRUE(e.observable) << e.name;
      EXPECT_NEAR(e.value, value_of(e.parameter, truth), 4.0 * e.sigma_within) << e.name;
    }
  }
}

TEST(VelocityCalibration, TheTableOfRelativeMotionsSaysWhatTheMotionsSayOneByOne) {
  Robot robot = nominal_velocity();
  robot.chassis.velocity = {1.02, 0.95, 0.01, 0.003};
  const Recording recording = with_relative_motions(true_velocity(1), 1);
  const calibration::Run run = prepare_run(recording, robot);
  const std::vector<Parameter> parameters(kVelocityParameters.begin(), kVelocityParameters.end());
  const auto table = relative_table(run, robot);
  ASSERT_TRUE(table.has_value());
  RelativeWeights weights;
  weights.information = Matrix3::Identity();
  const Information sums = relative_information(*table, robot, parameters, weights, 1).front();
  const RelativeResiduals each = relative_residuals(run, robot, parameters);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(4, 4);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(4);
  for (std::size_t i = 0; i < each.residual.size(); ++i) {
    matrix += each.jacobian[i].transpose() * each.jacobian[i];
    gradient += each.jacobian[i].transpose() * each.residual[i];
  }
  EXPECT_LT((sums.matrix - matrix).norm(), 1e-9 * matrix.norm());
  EXPECT_LT((sums.gradient - gradient).norm(), 1e-9 * gradient.norm());
}

// Errors of parameters grow with the distance, those of readings with its root: the second drive is long
// enough to tell, and short enough for a heading's sigma to stay below half a radian.
TEST(VelocityCalibration, GivesOdometryTheUncertaintyOfTheParameters) {
  double nees = 0.0, exact = 0.0;
  const int seeds = test::trials(60, 20);
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto s = static_cast<std::uint64_t>(seed);
    const Robot truth = true_velocity(s);
    const auto learned = test::recorded(nominal_velocity(), truth, test::differential_paths(), s);
    Robot robot = calibrate(learned, {}, nominal_velocity()).calibrated;
    const Simulation driven = simulate(velocity_scenario(truth, 1000 + s, 80.0));
    const Pose2 start = driven.truth.body.poses.front().pose;
    const Vector3 error = [&] {
      const Pose2 end = integrate(driven.recording, robot, {.start = start}).end.pose;
      const Pose2& true_end = driven.truth.body.poses.back().pose;
      return Vector3(end.x - true_end.x, end.y - true_end.y, end.heading - true_end.heading);
    }();
    const auto nees_of = [&](const Robot& r) {
      const Matrix3 P = integrate(driven.recording, r, {.start = start}).end_covariance;
      return error.dot(P.ldlt().solve(error));
    };
    nees += nees_of(robot);
    robot.calibration.reset();
    exact += nees_of(robot);
  }
  const double dof = 3.0 * seeds;
  EXPECT_LT(nees, chi_squared_limit(1e-3, dof));
  EXPECT_GT(nees, chi_squared_limit(1.0 - 1e-3, dof));
  EXPECT_GT(exact, chi_squared_limit(1e-3, dof));
}

TEST(VelocityCalibration, StartsRightWhereTheStreamIsInAnotherUnit) {
  Robot truth = true_velocity(1);
  truth.chassis.velocity.forward_scale = 1.7;
  const Recording recording = velocity_recording(truth, 1);
  const CalibrationResult result = calibrate({&recording, 1}, {}, nominal_velocity());
  EXPECT_NEAR(result.calibrated.chassis.velocity.forward_scale, 1.7,
              4.0 * result.parameters.front().sigma_within);
  EXPECT_THAT(result.warnings, testing::Contains(testing::HasSubstr("as far as velocity.csv")));
  truth.chassis.velocity.forward_scale = 0.001;
  Recording millimetres = recording;
  for (double& forward : millimetres.velocity.forward_m_s) forward *= 1700.0;
  EXPECT_THROW(calibrate({&millimetres, 1}, {}, nominal_velocity()), CannotAnswer);
}

TEST(VelocityCalibration, SaysWhatAStraightRunCannotTell) {
  Scenario scenario = velocity_scenario(nominal_velocity(), 3, 10.0);
  scenario.path = straight(5.0);
  Recording recording = simulate(scenario).recording;
  recording.name = "straight";
  const CalibrationResult result = calibrate({&recording, 1}, {}, nominal_velocity());
  EXPECT_EQ(result.status, CalibrationStatus::some_held);
  EXPECT_EQ(result.calibrated.chassis.velocity.yaw_scale, 1.0);
  EXPECT_THAT(result.unobservable, testing::Contains(testing::HasSubstr("velocity.yaw_scale")));
}

TEST(VelocityCalibration, SaysSoWhereNothingWasMeasured) {
  Recording recording = velocity_recording(nominal_velocity(), 3, 10.0);
  recording.reference = {};
  EXPECT_THROW(calibrate({&recording, 1}, {}, nominal_velocity()), CannotAnswer);
}

// The gyro shows how far the stream's turns are off in proportion to it, and nothing of its lengths.
TEST(VelocityCalibration, TakesTurnsFromAGyroWithoutAReference) {
  Robot nominal = nominal_velocity(), truth = true_velocity(5);
  nominal.chassis.gyro = truth.chassis.gyro = Gyro{};
  Scenario scenario = velocity_scenario(truth, 5, 60.0);
  scenario.nominal = nominal;
  Recording recording = simulate(scenario).recording;
  recording.name = "tour";
  recording.reference = {};
  const CalibrationResult result = calibrate({&recording, 1}, {}, nominal, {.fix = {"gyro.bias"}});
  for (const ParameterEstimate& e : result.parameters) {
    EXPECT_NE(e.parameter.kind, ParameterKind::velocity_forward_scale);
    if (e.parameter.kind == ParameterKind::velocity_yaw_scale) {
      EXPECT_NEAR(e.value, value_of(e.parameter, truth), 4.0 * e.sigma_within + 0.01);
    }
  }
}

TEST(VelocityCalibration, IsAGroupThatCanBeFixed) {
  const Recording recording = velocity_recording(true_velocity(1), 1);
  EXPECT_THROW(calibrate({&recording, 1}, {}, nominal_velocity(), {.fix = {"velocity"}}), CannotAnswer);
  EXPECT_THROW(calibrate({&recording, 1}, {}, test::nominal_differential(), {.fix = {"velocity"}}),
               InputError);
}

// Without its lag the scale of its turns would come out 0.05 too small.
TEST(VelocityCalibration, ARobotThatLagsBehindWhatItIsToldTurnsByAsMuch) {
  const Recording recording = test::lagging_recording({.lag_s = 0.2, .delay_s = 0.1, .yaw_scale = 0.95}, 5);
  const CalibrationResult result = calibrate({&recording, 1}, {}, test::told_robot());
  EXPECT_THAT(result.notes, testing::Contains(testing::HasSubstr("velocity.lag_s 0.")));
  EXPECT_NEAR(result.calibrated.chassis.velocity.lag_s, 0.2, 0.02);
  const auto yaw_scale = std::ranges::find(result.parameters, "velocity.yaw_scale", &ParameterEstimate::name);
  ASSERT_NE(yaw_scale, result.parameters.end());
  EXPECT_NEAR(yaw_scale->value, 0.95, 3.0 * yaw_scale->sigma_total);
  EXPECT_LT(yaw_scale->sigma_total, 0.01);

  EXPECT_THAT(result.velocity_lag.value_or(""), testing::HasSubstr("in 1 recording"));

  const CalibrationResult fixed =
      calibrate({&recording, 1}, {}, test::told_robot(), {.free = {"reference.x"}, .fix = {"velocity"}});
  EXPECT_EQ(fixed.calibrated.chassis.velocity.lag_s, 0.0);
}

// One that says so by chance has the others against it; and a clock that was set with a lag of none keeps
// time.
TEST(VelocityCalibration, RecordingsSayTogetherWhetherARobotLags) {
  std::vector<Recording> recordings;
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    recordings.push_back(test::lagging_recording({.duration_s = 60.0}, seed));
  Robot robot = test::told_robot();
  EXPECT_FALSE(set_velocity_lag(recordings, recording::velocity_lag_by_reference, "the reference", robot));
  EXPECT_EQ(robot.chassis.velocity.lag_s, 0.0);

  robot.chassis.velocity.lag_s = 0.2;
  robot.landmark_sensor->time_offset_s = -0.1;
  EXPECT_TRUE(set_velocity_lag(recordings, recording::velocity_lag_by_reference, "the reference", robot));
  EXPECT_NEAR(robot.chassis.velocity.lag_s, 0.0, 0.02);
  EXPECT_NEAR(robot.landmark_sensor->time_offset_s, -0.3 + robot.chassis.velocity.lag_s, 1e-12);
  EXPECT_EQ(robot.reference_time_offset_s, 0.0);
}

}  // namespace
}  // namespace trundle::calibration
