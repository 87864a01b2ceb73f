#include "trundle/odometry/uncertain.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "trundle/chassis/usual_parameters.hpp"
#include "trundle/geometry/squared.hpp"
#include "trundle/io/error.hpp"

namespace trundle::odometry {
namespace {

Eigen::MatrixXd covariance_of(const Robot& robot) {
  if (!robot.calibration) return {};
  const std::vector<Eigen::Index> uncertain = robot.calibration->uncertain();
  if (uncertain.empty()) return {};
  const Eigen::MatrixXd& covariance = robot.calibration->covariance;
  const auto n = std::ssize(robot.calibration->parameters);
  if (covariance.rows() == n && covariance.cols() == n) return covariance(uncertain, uncertain);
  throw InputError(
      place_of(robot),
      fmt::format("the covariance of [calibration] is {}×{}", covariance.rows(), covariance.cols()),
      fmt::format("{}×{}, one row for each parameter", n, n));
}

void remove(Eigen::Index index, Eigen::MatrixXd& covariance) {
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i)
    if (i != index) others.push_back(i);
  covariance = Eigen::MatrixXd(covariance(others, others));
}

/// A bias that is learned is no longer a parameter: initial_bias_sigma() says where it starts.
void make_bias_a_state(UncertainParameters& uncertain) {
  const auto bias = std::ranges::find(uncertain.parameters, kGyroBias);
  if (bias == uncertain.parameters.end()) return;
  const auto index = bias - uncertain.parameters.begin();
  uncertain.parameters.erase(bias);
  remove(index, uncertain.covariance);
}

}  // namespace

std::vector<Parameter> calibrated_parameters(const Robot& robot) {
  std::vector<Parameter> parameters;
  if (!robot.calibration) return parameters;
  for (const Eigen::Index i : robot.calibration->uncertain()) {
    const std::string& name = robot.calibration->parameters[static_cast<std::size_t>(i)].name;
    const auto parameter = parameter_named(name, robot);
    if (!parameter)
      throw InputError(place_of(robot), fmt::format("[calibration] names '{}'", name),
                       "a parameter that this robot has");
    parameters.push_back(*parameter);
  }
  return parameters;
}

UncertainParameters uncertain_parameters(const Robot& robot, bool learn_gyro_bias) {
  UncertainParameters uncertain{calibrated_parameters(robot), covariance_of(robot)};
  if (learn_gyro_bias) make_bias_a_state(uncertain);
  return uncertain;
}

UncertainParameters with_usual_parameters(const std::vector<Parameter>& parameters, const Robot& robot) {
  UncertainParameters all{parameters, {}};
  for (const Parameter& usual : usual_parameters(robot))
    if (usual != kGyroBias && std::ranges::find(all.parameters, usual) == all.parameters.end())
      all.parameters.push_back(usual);
  const UncertainParameters calibrated = uncertain_parameters(robot, true);
  const auto in_calibration = [&](const Parameter& parameter) {
    return std::ranges::find(calibrated.parameters, parameter) - calibrated.parameters.begin();
  };
  const auto known = static_cast<std::ptrdiff_t>(calibrated.parameters.size());
  const auto n = static_cast<Eigen::Index>(all.parameters.size());
  all.covariance.setZero(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Parameter& parameter = all.parameters[static_cast<std::size_t>(i)];
    const std::ptrdiff_t a = in_calibration(parameter);
    if (a == known) all.covariance(i, i) = squared(prior_sigma(parameter, robot));
    for (Eigen::Index k = 0; k < n && a < known; ++k) {
      const std::ptrdiff_t b = in_calibration(all.parameters[static_cast<std::size_t>(k)]);
      if (b < known) all.covariance(i, k) = calibrated.covariance(a, b);
    }
  }
  return all;
}

Matrix3 total_covariance(const Odometer& odometer, const Eigen::MatrixXd& covariance) {
  const Matrix3 white = odometer.white_covariance();
  return covariance.size() == 0 ? white : white + parameter_covariance(odometer.sensitivity(), covariance);
}

}  // namespace trundle::odometry
