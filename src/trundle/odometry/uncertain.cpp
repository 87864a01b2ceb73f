#include "trundle/odometry/uncertain.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/odometry/integrate.hpp"

namespace trundle::odometry {
namespace {

Eigen::MatrixXd covariance_of(const Robot& robot, std::size_t parameters) {
  if (parameters == 0) return {};
  const Eigen::MatrixXd& covariance = robot.calibration->covariance;
  const auto n = static_cast<Eigen::Index>(parameters);
  if (covariance.rows() == n && covariance.cols() == n) return covariance;
  throw InputError(
      place_of(robot),
      fmt::format("the covariance of [calibration] is {}×{}", covariance.rows(), covariance.cols()),
      fmt::format("{}×{}, one row for each observable parameter", n, n));
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

UncertainParameters uncertain_parameters(const Robot& robot, bool learn_gyro_bias) {
  UncertainParameters uncertain{calibrated_parameters(robot), {}};
  uncertain.covariance = covariance_of(robot, uncertain.parameters.size());
  if (learn_gyro_bias) make_bias_a_state(uncertain);
  return uncertain;
}

Matrix3 total_covariance(const Odometer& odometer, const Eigen::MatrixXd& covariance) {
  const Matrix3 white = odometer.white_covariance();
  return covariance.size() == 0 ? white : white + parameter_covariance(odometer.sensitivity(), covariance);
}

}  // namespace trundle::odometry
