#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/odometry/odometer.hpp"

namespace trundle::odometry {

/// The parameters that a calibration gives a covariance of, in its order. Throws InputError.
[[nodiscard]] std::vector<Parameter> calibrated_parameters(const Robot& robot);

/// The parameters whose uncertainty an odometer carries along, and their covariance.
struct UncertainParameters {
  std::vector<Parameter> parameters;
  Eigen::MatrixXd covariance;
};

/// Those of the calibration; without the gyro's bias where that is learned. Throws InputError.
UncertainParameters uncertain_parameters(const Robot& robot, bool learn_gyro_bias);

/// `parameters` and then the usual ones of the robot that are none of them, without the gyro's bias: as far
/// as they are calibrated with that covariance, else each with its prior_sigma(). Throws InputError.
UncertainParameters with_usual_parameters(const std::vector<Parameter>& parameters, const Robot& robot);

/// White part and parameter part together.
Matrix3 total_covariance(const Odometer& odometer, const Eigen::MatrixXd& parameter_covariance);

}  // namespace trundle::odometry
