#pragma once

#include <vector>

#include <Eigen/Core>

#include "trundle/calibration/result.hpp"
#include "trundle/geometry/decompositions.hpp"

namespace trundle::test {

/// What was estimated, against the truth and with what is stated of it. Without the gyro's bias, which is
/// another one in each run and walks.
struct StatedErrors {
  std::vector<calibration::ParameterEstimate> parameters;
  Eigen::VectorXd error;
  Eigen::MatrixXd covariance;  ///< within a session

  double nees() const { return error.dot(geometry::solve_ldlt(covariance, error)); }
  double expected_nees() const { return static_cast<double>(error.size()); }
};

inline StatedErrors stated_errors(const calibration::CalibrationResult& result, const chassis::Robot& truth) {
  StatedErrors stated;
  std::vector<Eigen::Index> kept;
  Eigen::Index row = 0;
  for (const calibration::ParameterEstimate& e : result.parameters) {
    if (!e.observable) continue;
    if (e.parameter != chassis::kGyroBias) {
      kept.push_back(row);
      stated.parameters.push_back(e);
    }
    ++row;
  }
  stated.error.resize(static_cast<Eigen::Index>(kept.size()));
  for (std::size_t i = 0; i < kept.size(); ++i)
    stated.error[static_cast<Eigen::Index>(i)] =
        stated.parameters[i].value - chassis::value_of(stated.parameters[i].parameter, truth);
  stated.covariance = result.covariance_within(kept, kept);
  return stated;
}

}  // namespace trundle::test
