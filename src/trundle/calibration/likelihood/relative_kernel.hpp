#pragma once

#include <array>
#include <limits>
#include <span>

#include <Eigen/Core>

#include "trundle/odometry/motion_model.hpp"

namespace trundle::calibration {

/// Measured displacements of a sensor in its own frame, and what the wheels read over the same intervals:
/// columns of one length.
struct RelativeColumns {
  /// The inputs of LinearisedChassis in their order: revolutions of each wheel (without wheels: forward [m],
  /// turn [rad]); where it uses the gyro, its integral [rad] and the duration [s].
  std::array<std::span<const double>, kMaxInputs> input{};
  std::span<const double> x_m;
  std::span<const double> y_m;
  std::span<const double> heading_rad;

  std::size_t rows() const { return x_m.size(); }
};

struct RelativeWeights {
  Matrix3 information = Matrix3::Identity();  ///< Ω of a displacement (x, y, heading) in the sensor's frame
  /// A residual with a larger rᵀ Ω r teaches nothing and costs as much as this.
  double gate = std::numeric_limits<double>::infinity();
};

/// The linearised least-squares problem of r = measured − predicted, predicted = ℓ⁻¹ exp(ξ) ℓ with ℓ =
/// body_from_sensor. Parameters: those of LinearisedChassis::derivative, then x, y [m] and heading [rad] of
/// ℓ. Gauss–Newton's step is information⁻¹ · gradient.
struct RelativeNormalEquations {
  Eigen::MatrixXd information;  ///< Σ Jᵀ Ω J, J = ∂predicted/∂p
  Eigen::VectorXd gradient;     ///< Σ Jᵀ Ω r
  double cost = 0.0;            ///< Σ min(rᵀ Ω r, gate)
  std::size_t outliers = 0;     ///< beyond the gate
};

/// Sums the normal equations over all increments in one pass, many at a time; the same bits on every
/// processor. Its cost does not depend on the number of chassis parameters. docs/theory/calibration.md,
/// section on relative motions [Censi et al. 2013 give the problem]. Throws InputError when columns differ in
/// length.
RelativeNormalEquations accumulate_relative(const RelativeColumns& columns, const LinearisedChassis& chassis,
                                            const Pose2& body_from_sensor,
                                            const RelativeWeights& weights = {});

}  // namespace trundle::calibration
