#include "trundle/calibration/validation/cross_validation.hpp"

#include <gmock/gmock.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/problem/defaults.hpp"
#include "trundle/odometry/integrate.hpp"
#include "trundle/odometry/uncertain.hpp"

#include "calibration/simulated_runs.hpp"
#include "calibration/steered_drives.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using testing::Contains;
using testing::HasSubstr;
using namespace test;

using Runs = std::vector<Run>;

CalibrationProblem problem_of(Runs& runs, const Robot& nominal) {
  return {runs, nominal, default_parameters(nominal, from_outside(runs))};
}

TEST(CrossValidation, WhatIsRightHoldsBeyondTheRuns) {
  Runs runs = prepared(nominal_differential(), true_differential(), differential_paths(), 1);
  const ValidatedEstimate validated = estimate_what_holds(problem_of(runs, nominal_differential()));
  ASSERT_TRUE(validated.validation);
  EXPECT_EQ(validated.validation->parts, runs.size());
  EXPECT_FALSE(validated.validation->of_halves);
  EXPECT_LT(validated.validation->calibrated_m, 0.2 * validated.validation->given_m);
  EXPECT_TRUE(validated.refused.parameters.empty());
}

TEST(CrossValidation, OfOneRunEachHalfIsJudgedByTheOther) {
  const Path tour = trundle::simulation::joined(
      {square(1.5, TurnSense::ccw), square(1.5, TurnSense::cw), square(1.5, TurnSense::ccw)});
  Runs runs = prepared(nominal_differential(), true_differential(), {tour}, 2);
  const ValidatedEstimate validated = estimate_what_holds(problem_of(runs, nominal_differential()));
  ASSERT_TRUE(validated.validation);
  EXPECT_EQ(validated.validation->parts, 2U);
  EXPECT_TRUE(validated.validation->of_halves);
  EXPECT_LT(validated.validation->calibrated_m, 0.3 * validated.validation->given_m);
}

TEST(CrossValidation, OfNothingObservableThereIsNone) {
  const Robot robot = nominal_differential();
  Runs runs = prepared(robot, robot, {straight(2.0), straight(2.0)}, 4);
  const CalibrationProblem problem{runs, robot, {{ParameterKind::track, -1}}};
  const Estimate estimate = estimate_parameters(problem);
  ASSERT_EQ(estimate.space.basis.cols(), 0);
  EXPECT_FALSE(cross_validate(problem, estimate));
}

/// A reference that turns away in the first half of each run and comes back in the second, as one that
/// drifts: what it makes of the track in one run is wrong in the next.
std::vector<Recording> drifting(std::vector<Recording> recordings) {
  double sign = 1.0;
  for (Recording& recording : recordings) {
    ReferenceStream& reference = recording.reference;
    const double start_s = reference.time_s.front();
    for (std::size_t i = 0; i < reference.time_s.size(); ++i) {
      const double angle = sign * 0.02 * (reference.time_s[i] - start_s);
      const Vector2 turned = rotation(angle) * Vector2(reference.x_m[i], reference.y_m[i]);
      reference.x_m[i] = turned.x();
      reference.y_m[i] = turned.y();
      reference.heading_rad[i] += angle;
    }
    sign = -sign;
  }
  return recordings;
}

TEST(CrossValidation, WhatOnlyOneRunSaysIsRefusedAndNamed) {
  const Robot truth = nominal_differential();
  const std::vector<Path> paths = {square(1.5, TurnSense::ccw), square(1.5, TurnSense::ccw)};
  const std::vector<Recording> recordings = drifting(recorded(nominal_differential(), truth, paths, 3));
  Runs runs;
  for (const Recording& recording : recordings)
    runs.push_back(prepare_run(recording, nominal_differential()));
  const ValidatedEstimate validated = estimate_what_holds(problem_of(runs, nominal_differential()));
  EXPECT_FALSE(validated.refused.parameters.empty());
  ASSERT_TRUE(validated.before);
  EXPECT_TRUE(validated.before->is_worse());
  EXPECT_TRUE(!validated.validation || !validated.validation->is_worse());
  const CalibrationResult result = calibrate(recordings, {}, nominal_differential());
  EXPECT_THAT(result.warnings, Contains(HasSubstr("stays as given")));

  // The odometry of the calibrated robot carries along how wrong that may be; and on drives like the runs
  // what was estimated beside it makes up for it.
  Robot robot = result.calibrated;
  EXPECT_EQ(odometry::uncertain_parameters(robot, false).parameters.size(), 3U);
  const auto sigma_rad = [&] {
    return std::sqrt(integrate(runs.front().readings, robot).end_parameter_covariance(2, 2));
  };
  const double together_rad = sigma_rad();
  Eigen::MatrixXd& covariance = robot.calibration->covariance;
  covariance = Eigen::MatrixXd(covariance.diagonal().asDiagonal());
  EXPECT_LT(together_rad, 0.5 * sigma_rad());
}

TEST(CrossValidation, WhatIsRefusedTakesAlongWhatIsEstimatedBesideIt) {
  const Parameter track{ParameterKind::track, -1};
  Robot nominal = nominal_differential();
  set_value(track, value_of(track, true_differential()), nominal);  // else it would pass for noise
  Runs runs = prepared(nominal, true_differential(), differential_paths(), 5);
  CalibrationProblem problem{runs, nominal, {{ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}}};
  const Estimate estimate = estimate_parameters(problem);
  const Eigen::MatrixXd D = taken_along(std::span(&track, 1), problem, estimate);
  const double wider_m = 0.002 * value_of(track, nominal);
  set_value(track, value_of(track, nominal) + wider_m, problem.nominal);
  const Estimate with_wider = estimate_parameters(problem);
  Eigen::Vector2d follows;
  for (int i = 0; i < 2; ++i) {
    const Parameter& diameter = problem.parameters[static_cast<std::size_t>(i)];
    follows[i] = (value_of(diameter, with_wider.robot) - value_of(diameter, estimate.robot)) / wider_m;
  }
  EXPECT_TRUE(D.isApprox(follows, 0.025)) << D << "\nand by moving it\n" << follows;
}

/// The track given is off by what the runs say; one of twice the size is off by more than given may be.
TEST(CrossValidation, WhatStaysAsGivenIsAsWrongAsTheRunsSayAndAsItMayBe) {
  const Robot truth = true_differential();
  Robot given = nominal_differential();
  Runs runs = prepared(given, truth, differential_paths(), 5);
  const Parameter track{ParameterKind::track, -1};
  const double off_m = value_of(track, given) - value_of(track, truth);
  const CalibrationProblem problem{
      runs, given, {{ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}, track}};
  const Eigen::MatrixXd error = error_as_given(problem, estimate_parameters(problem));
  EXPECT_NEAR(std::sqrt(error(2, 2)), std::abs(off_m), 0.1 * std::abs(off_m));

  set_value(track, 2.0 * value_of(track, truth), given);
  const CalibrationProblem far{runs, given, problem.parameters};
  EXPECT_NEAR(std::sqrt(error_as_given(far, estimate_parameters(far))(2, 2)), prior_sigma(track, given),
              1e-9);
}

/// A car with a gyro, as its file has it but for the zero of its steering.
TEST(CrossValidation, WhatTheRunsAreSureOfIsNotGivenUpForWhatMayBeChance) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  const Parameter zero{ParameterKind::steering_zero, 2};
  Robot nominal = steered_robot("car");
  nominal.chassis.gyro = Gyro{.noise_rad_s_sqrt_hz = 3e-4, .bias_walk_rad_s_sqrt_s = 0.0};
  Robot truth = nominal;
  set_value(zero, 0.01, truth);
  Runs runs;
  for (const double tightest_m : {1.0, 0.7})
    runs.push_back(prepare_run(simulated_drive(truth, rich_drive(tightest_m), 114 + runs.size()), nominal));
  const CalibrationProblem problem = problem_of(runs, nominal);
  ASSERT_THAT(problem.parameters, Contains(zero));
  const auto all = cross_validate(problem, estimate_parameters(problem));
  ASSERT_TRUE(all);
  ASSERT_TRUE(all->is_worse()) << "another seed is wanted: a drive that came out worse by chance";
  const ValidatedEstimate validated = estimate_what_holds(problem);
  EXPECT_THAT(validated.parameters, Contains(zero));
  EXPECT_NEAR(value_of(zero, validated.estimate.robot), 0.01, 0.001);
}

}  // namespace
}  // namespace trundle::calibration
