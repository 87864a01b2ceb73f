#include "trundle/calibration/likelihood/relative_kernel.hpp"

#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>
#include <hwy/targets.h>

#include "trundle/io/error.hpp"

#include "chassis/robots.hpp"

namespace trundle::calibration {
namespace {

/// Increments and what a sensor measured over each, with errors of some millimetres.
struct Motions {
  std::vector<Increment> increments;
  std::vector<Pose2> measured;
  std::array<std::vector<double>, kMaxInputs> input;
  std::array<std::vector<double>, 3> column;

  RelativeColumns columns() const {
    RelativeColumns columns{.input = {}, .x_m = column[0], .y_m = column[1], .heading_rad = column[2]};
    for (std::size_t k = 0; k < kMaxInputs; ++k) columns.input[k] = input[k];
    return columns;
  }
};

Twist2 twist_of(const Robot& robot, const Increment& increment) {
  const Rows rows = rows_of(robot.chassis, increment.has_gyro);
  return estimate_twist(rows, readings_of(robot.chassis, rows, increment)).twist;
}

Pose2 predicted(const Robot& robot, const Increment& increment) {
  return robot.body_from_reference.inverse() * exp(twist_of(robot, increment)) * robot.body_from_reference;
}

/// `turn_rad`: how far an increment turns at most.
Motions simulated(const Robot& truth, std::size_t rows, double turn_rad) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> any(-1.0, 1.0);
  Motions motions;
  const bool gyro = truth.chassis.gyro.has_value();
  const auto wheels = static_cast<std::size_t>(truth.chassis.wheel_count > 0 ? truth.chassis.wheel_count : 2);
  for (std::size_t i = 0; i < rows; ++i) {
    Increment increment{.duration_s = 0.1, .gyro_rad = turn_rad * any(random), .has_gyro = gyro};
    for (double& turned : increment.turned) turned = (gyro ? 0.2 : turn_rad) * any(random);
    const Pose2 motion = predicted(truth, increment);
    motions.increments.push_back(increment);
    motions.measured.push_back({motion.x + 0.003 * any(random), motion.y + 0.003 * any(random),
                                wrap_angle(motion.heading + 0.01 * any(random))});
    const bool timed = gyro || truth.chassis.wheel_count == 0;
    for (std::size_t k = 0; k < wheels; ++k) motions.input[k].push_back(increment.turned[k]);
    if (timed) motions.input[wheels].push_back(increment.gyro_rad);
    if (timed) motions.input[wheels + 1].push_back(increment.duration_s);
    motions.column[0].push_back(motions.measured.back().x);
    motions.column[1].push_back(motions.measured.back().y);
    motions.column[2].push_back(motions.measured.back().heading);
  }
  return motions;
}

Vector3 components(const Pose2& pose) {
  return {pose.x, pose.y, pose.heading};
}

/// The same sums by a plain loop and central differences.
RelativeNormalEquations plainly(const Motions& motions, const Robot& robot,
                                const std::vector<Parameter>& parameters, const RelativeWeights& weights) {
  const auto n = static_cast<Eigen::Index>(parameters.size());
  RelativeNormalEquations sums{Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n), 0.0, 0};
  for (std::size_t i = 0; i < motions.increments.size(); ++i) {
    Eigen::MatrixXd J(3, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const Parameter& parameter = parameters[static_cast<std::size_t>(j)];
      constexpr double kStep = 1e-6;
      Robot more = robot;
      Robot less = robot;
      set_value(parameter, value_of(parameter, robot) + kStep, more);
      set_value(parameter, value_of(parameter, robot) - kStep, less);
      J.col(j) = (components(predicted(more, motions.increments[i])) -
                  components(predicted(less, motions.increments[i]))) /
                 (2.0 * kStep);
    }
    Vector3 r = components(motions.measured[i]) - components(predicted(robot, motions.increments[i]));
    r.z() = wrap_angle(r.z());
    const double chi2 = r.dot(weights.information * r);
    sums.cost += std::min(chi2, weights.gate);
    if (chi2 > weights.gate) {
      ++sums.outliers;
      continue;
    }
    sums.information += J.transpose() * weights.information * J;
    sums.gradient += J.transpose() * weights.information * r;
  }
  return sums;
}

RelativeWeights some_weights() {
  RelativeWeights weights;
  weights.information << 4e4, 5e3, 2e3, 5e3, 9e4, -1e3, 2e3, -1e3, 1e4;
  return weights;
}

void expect_the_plain_sums(const Chassis& chassis, double turn_rad, const RelativeWeights& weights) {
  Robot truth = test::robot_of(chassis);
  truth.body_from_reference = {0.12, -0.05, 0.4};
  const Motions motions = simulated(truth, 205, turn_rad);
  Robot robot = truth;
  robot.body_from_reference = {0.1, 0.02, 0.3};
  robot.chassis.wheels()[0].diameter_m *= 1.02;
  std::vector<Parameter> parameters = {
      {ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}, {ParameterKind::lever, 1}};
  const MotionModel model(robot.chassis, parameters, true);
  ASSERT_TRUE(model.square());
  const RelativeNormalEquations sums =
      accumulate_relative(motions.columns(), model.linearised(), robot.body_from_reference, weights);
  for (const ParameterKind kind :
       {ParameterKind::reference_x, ParameterKind::reference_y, ParameterKind::reference_heading})
    parameters.push_back({kind, -1});
  const RelativeNormalEquations expected = plainly(motions, robot, parameters, weights);
  EXPECT_NEAR(sums.cost, expected.cost, 1e-10 * expected.cost);
  EXPECT_EQ(sums.outliers, expected.outliers);
  EXPECT_EQ(sums.outliers > 0, std::isfinite(weights.gate));
  EXPECT_LT((sums.gradient - expected.gradient).norm(), 1e-7 * expected.gradient.norm());
  EXPECT_LT((sums.information - expected.information).norm(), 1e-7 * expected.information.norm());
}

TEST(RelativeKernel, SumsOfADifferentialDrive) {
  expect_the_plain_sums(differential_drive(test::kSize, 0.5), 0.2, some_weights());
}
TEST(RelativeKernel, SumsOfOmni3) {
  expect_the_plain_sums(omni3(test::kSize, 0.2), 0.2, some_weights());
}
TEST(RelativeKernel, SumsOfPodsAndGyro) {
  expect_the_plain_sums(test::two_pods(), 0.4, some_weights());
}
TEST(RelativeKernel, TurnsOfAnySize) {
  expect_the_plain_sums(test::two_pods(), 6.0, some_weights());
}
TEST(RelativeKernel, EveryInstructionSetGivesTheSameBits) {
  const Robot robot = test::robot_of(test::two_pods());
  for (const double turn_rad : {0.4, 6.0}) {
    const Motions motions = simulated(robot, 205, turn_rad);
    const MotionModel model(robot.chassis, {}, true);
    RelativeWeights weights = some_weights();
    weights.gate = 1.5;
    std::vector<RelativeNormalEquations> sums;
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
      hwy::SetSupportedTargetsForTest(target);
      sums.push_back(accumulate_relative(motions.columns(), model.linearised(), {0.1, 0.02, 0.3}, weights));
      hwy::SetSupportedTargetsForTest(0);
      EXPECT_EQ(sums.back().information, sums.front().information) << hwy::TargetName(target);
      EXPECT_EQ(sums.back().gradient, sums.front().gradient);
      EXPECT_EQ(sums.back().cost, sums.front().cost);
    }
  }
}
TEST(RelativeKernel, OutliersTeachNothing) {
  RelativeWeights weights = some_weights();
  weights.gate = 1.5;
  expect_the_plain_sums(differential_drive(test::kSize, 0.5), 0.2, weights);
}

TEST(RelativeKernel, GaussNewtonFindsTheRobotOfNoiseFreeMotions) {
  Robot truth = test::robot_of(differential_drive(test::kSize, 0.5));
  truth.body_from_reference = {0.12, -0.05, 0.4};
  Motions motions = simulated(truth, 200, 0.2);
  for (std::size_t i = 0; i < 200; ++i) {
    const Vector3 exact = components(predicted(truth, motions.increments[i]));
    for (std::size_t k = 0; k < 3; ++k) motions.column[k][i] = exact[static_cast<int>(k)];
  }
  Robot robot = truth;
  const std::vector<Parameter> parameters = {
      {ParameterKind::diameter, 0},     {ParameterKind::diameter, 1},
      {ParameterKind::track, -1},       {ParameterKind::reference_x, -1},
      {ParameterKind::reference_y, -1}, {ParameterKind::reference_heading, -1}};
  for (const Parameter& parameter : parameters)
    set_value(parameter, 0.9 * value_of(parameter, robot) + 0.01, robot);
  for (int iteration = 0; iteration < 8; ++iteration) {
    const MotionModel model(robot.chassis, std::span(parameters).first(3), false);
    const RelativeNormalEquations sums =
        accumulate_relative(motions.columns(), model.linearised(), robot.body_from_reference);
    const Eigen::VectorXd step = sums.information.ldlt().solve(sums.gradient);
    for (std::size_t j = 0; j < parameters.size(); ++j)
      set_value(parameters[j], value_of(parameters[j], robot) + step[static_cast<Eigen::Index>(j)], robot);
  }
  for (const Parameter& parameter : parameters)
    EXPECT_NEAR(value_of(parameter, robot), value_of(parameter, truth), 1e-12) << name_of(parameter, robot);
}

TEST(RelativeKernel, RefusesColumnsOfDifferentLength) {
  const Robot robot = test::robot_of(differential_drive(test::kSize, 0.5));
  Motions motions = simulated(robot, 9, 0.1);
  motions.input[1].pop_back();
  const MotionModel model(robot.chassis, {}, false);
  EXPECT_THROW(accumulate_relative(motions.columns(), model.linearised(), {}), InputError);
}

}  // namespace
}  // namespace trundle::calibration
