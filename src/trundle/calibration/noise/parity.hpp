#pragma once

#include "trundle/calibration/likelihood/common_errors.hpp"
#include "trundle/calibration/noise/displacements.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {

/// What no motion explains in a chassis with or without its gyro, from the geometry alone; of wheels with an
/// encoder that are steered nothing.
struct Redundancy {
  Rows rows;
  Combinations P;
};
[[nodiscard]] Redundancy redundancy_of(const Robot& robot);

/// Steps the odometer from the start of a displacement to its end. Returns the covariance of the error of its
/// pose with Pᵀ Σ z. docs/theory/calibration-noise-displacements.md, eq. 10a.
[[nodiscard]] CommonError common_error_along(const CommonErrors& common, const Displacement& displacement,
                                             Odometer& odometer);

}  // namespace trundle::calibration
