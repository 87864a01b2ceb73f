#pragma once

#include <span>
#include <vector>

#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// Residuals of the reference sensor's own displacements (scan matching): measured − predicted, where the
/// prediction is sensor_from_body * (body's motion) * body_from_sensor. docs/theory/calibration.md, 'Relative
/// motions'.
struct RelativeResiduals {
  std::vector<Vector3> residual;                                   ///< [m, m, rad]
  std::vector<Eigen::Matrix<double, 3, Eigen::Dynamic>> jacobian;  ///< ∂prediction/∂p
  std::vector<double> start_s;
};
RelativeResiduals relative_residuals(const Run& run, const Robot& robot,
                                     std::span<const Parameter> parameters);

/// Robust covariance of the residuals about zero: of the half of them that is most alike, scaled to the
/// Gaussian's (reweighted minimum covariance determinant, by concentration steps from the coordinate-wise
/// median). There must be one at least.
Matrix3 robust_covariance(const std::vector<Vector3>& residuals);

}  // namespace trundle::calibration
