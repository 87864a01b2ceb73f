// What is held at nominal is as wrong as nominal is: that is part of the error bars.
#include <cmath>
#include <cstdio>

#include <Eigen/QR>
#include <gtest/gtest.h>

#include "trundle/calibration/calibrate.hpp"
#include "trundle/calibration/solve/observability.hpp"
#include "trundle/odometry/uncertain.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/random.hpp"

#include "calibration/simulated_runs.hpp"
#include "calibration/steered_drives.hpp"
#include "scale.hpp"

namespace trundle::calibration {
namespace {

using namespace test;
using simulation::Segment;
using statistics::chi_squared_limit;

Eigen::VectorXd normal_vector(Eigen::Index n, Random& random) {
  return Eigen::VectorXd::NullaryExpr(n, [&] { return random.normal(1.0); });
}

// Seen 0.9 times as well as the prior knows them, along which they move together, two diameters are each
// known better than by it, for the other combination tells nearly all.
TEST(EstimableSpace, HoldsACombinationThatThePriorKnowsBetter) {
  const Robot nominal = nominal_differential();
  const std::vector<Parameter> parameters = {{ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}};
  const Eigen::Vector2d scale = prior_sigmas(parameters, nominal);
  const Eigen::Vector2d together = Eigen::Vector2d(1.0, 1.0).normalized();
  const auto held_where = [&](double singular_value) {
    const Eigen::Matrix2d seen = 100.0 * Eigen::Matrix2d::Identity() +
                                 (singular_value * singular_value - 100.0) * together * together.transpose();
    const Eigen::Matrix2d unit = scale.cwiseInverse().asDiagonal();
    return estimable_space(unit * seen * unit, parameters, nominal).held;
  };
  EXPECT_TRUE(held_where(1.01).empty());
  const std::vector<HeldCombination> held = held_where(0.9);
  ASSERT_EQ(held.size(), 1U);
  EXPECT_NEAR(std::abs(held[0].combination.dot(together)), 1.0, 1e-12);
}

/// An oracle of its own: least squares of exact readings J x, with what is held left at 0 and all others
/// free, by a QR of J. What that is off by where what is held is off by one prior sigma, is the column of D.
TEST(HeldCovariance, IsThatOfWhatLeastSquaresMakesOfAWrongNominal) {
  const Robot nominal = steered_robot("tricycle");
  const std::vector<Parameter> parameters = {{ParameterKind::diameter, 0},
                                             {ParameterKind::steering_zero, 0},
                                             {ParameterKind::steering_scale, 0},
                                             {ParameterKind::place_x, 0}};
  const auto n = static_cast<Eigen::Index>(parameters.size());
  const Eigen::VectorXd scale = prior_sigmas(parameters, nominal);
  Random random(1);
  Eigen::MatrixXd readings(12, n);  // of parameters in prior sigmas: scale and place are hardly told apart
  for (Eigen::Index row = 0; row < readings.rows(); ++row) {
    readings.row(row) = 20.0 * normal_vector(n, random).transpose();
    readings(row, 2) = -readings(row, 3) + 0.03 * random.normal(1.0) + 0.5 * readings(row, 0);
  }
  const Eigen::MatrixXd J = readings * scale.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd information = J.transpose() * J;
  const EstimableSpace space = estimable_space(information, parameters, nominal);
  ASSERT_EQ(space.held.size(), 1U);

  const Eigen::VectorXd truth = scale.cwiseProduct(space.held[0].combination);
  const Eigen::MatrixXd free = scale.asDiagonal() * space.basis;
  const Eigen::VectorXd found = free * (J * free).colPivHouseholderQr().solve(J * truth);
  const Eigen::VectorXd error = found - truth;
  const Eigen::MatrixXd covariance = held_covariance(information, space, parameters, nominal);
  EXPECT_LT((covariance - error * error.transpose()).norm(), 1e-9 * covariance.norm());
}

/// Circles of one radius do not tell the steering's scale from the wheelbase: robots whose own are drawn from
/// the prior are found as far off as their error bars say.
TEST(HeldCovariance, IsWhatRobotsDrawnFromThePriorAreOffBy) {
  TRUNDLE_NOT_UNDER_SANITIZERS();
  constexpr double kChance = 1e-3;
  const Robot nominal = steered_robot("tricycle");
  const Parameter steering{ParameterKind::steering_scale, 0}, place{ParameterKind::place_x, 0};
  const auto circles = [](double radius_m) {
    return Path{Segment{{40.0, 0.0, 40.0 / radius_m}, 40.0 / kSpeed_m_s}};
  };
  const int robots = trials(40, 8);
  double squares = 0.0, within = 0.0, beside = 0.0;
  for (int i = 0; i < robots; ++i) {
    Random random(static_cast<std::uint64_t>(i), 7);
    Robot truth = nominal;
    for (const Parameter& parameter : {steering, place, Parameter{ParameterKind::diameter, 0}})
      set_value(parameter, value_of(parameter, nominal) + random.normal(prior_sigma(parameter, nominal)),
                truth);
    const auto seed = 2 * static_cast<std::uint64_t>(i);
    const std::vector<Recording> runs = {simulated_drive(truth, circles(8.0), seed),
                                         simulated_drive(truth, circles(-8.0), seed + 1)};
    const CalibrationResult result = calibrate(runs, {}, nominal, {.learn_noise = false});
    for (const ParameterEstimate& e : result.parameters) {
      const double error = e.value - value_of(e.parameter, truth);
      if (e.parameter == place) {
        squares += std::pow(error / e.sigma_total, 2);
        within += std::pow(error / e.sigma_within, 2);
      }
      // What the circles do show stays twenty times surer than the prior, and more.
      if (e.parameter.kind == ParameterKind::diameter) {
        beside += std::pow(error / e.sigma_total, 2);
        EXPECT_LT(e.sigma_total, 0.05 * e.sigma_prior);
      }
    }
  }
  std::printf("squares of errors over their sigmas: %.2f, %.2f without what is held; of the diameter %.2f\n",
              squares / robots, within / robots, beside / robots);
  EXPECT_LT(squares, chi_squared_limit(kChance, robots));
  EXPECT_GT(squares, chi_squared_limit(1.0 - kChance, robots));
  EXPECT_LT(beside, chi_squared_limit(kChance, robots));
}

/// Driving straight on shows no track: odometry goes on with one of ± 20 %.
TEST(HeldCovariance, IsPartOfWhatOdometryCarriesAlong) {
  const Robot nominal = nominal_differential();
  const Parameter track{ParameterKind::track, -1};
  const CalibrationResult result = calibrate(
      recorded(nominal, nominal, {simulation::straight(4.0), simulation::straight(4.0)}, 6), {}, nominal);
  const auto uncertain = odometry::uncertain_parameters(result.calibrated, false);
  const auto at = std::ranges::find(uncertain.parameters, track) - uncertain.parameters.begin();
  ASSERT_LT(at, std::ssize(uncertain.parameters));
  EXPECT_NEAR(std::sqrt(uncertain.covariance(at, at)), prior_sigma(track, nominal), 1e-9);
}

/// What a robot file's calibration says of a parameter is what is known of it.
TEST(HeldCovariance, TakesWhatTheRobotFileKnows) {
  Robot robot = nominal_differential();
  const std::vector<Parameter> parameters = {{ParameterKind::diameter, 0}, {ParameterKind::diameter, 1}};
  const double unknown = prior_sigma(parameters[1], robot);
  EXPECT_DOUBLE_EQ(prior_covariance(parameters, robot)(1, 1), unknown * unknown);
  CalibrationRecord record;
  for (const Parameter& parameter : parameters)
    record.parameters.push_back(
        {.name = name_of(parameter, robot), .unit = "m", .sigma_between = {}, .observable = true});
  record.covariance = 1e-8 * (Eigen::MatrixXd(2, 2) << 2.0, 1.0, 1.0, 3.0).finished();
  robot.calibration = record;
  EXPECT_EQ(prior_covariance(parameters, robot), record.covariance);
}

}  // namespace
}  // namespace trundle::calibration
