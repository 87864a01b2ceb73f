#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "trundle/chassis/parameter.hpp"
#include "trundle/chassis/rows.hpp"
#include "trundle/namespaces.hpp"

namespace trundle::calibration {

/// What no motion explains of readings, summed: y = Pᵀz, of covariance S, and J = −∂y/∂p, taken at a motion
/// that errs by its readings' noise. J_errors: the covariance of that in J's columns, one below the other;
/// only where it was asked for.
struct Contradiction {
  Eigen::VectorXd y;
  Eigen::MatrixXd S;
  Eigen::MatrixXd J;
  Eigen::MatrixXd J_errors;

  void add(const Contradiction& other) {
    y += other.y;
    S += other.S;
    J += other.J;
    J_errors += other.J_errors;
  }
};

/// What readings are compared by: the same for all where no wheel is steered.
/// docs/theory/calibration-redundancy.md, eq. 7.
struct Comparison {
  const Chassis& chassis;
  const Rows& rows;
  std::span<const Parameter> parameters;
  Combinations P;
  const Chassis& driven;    ///< as it moved, by which derivatives are taken; the same if no wheel is steered
  const Rows& driven_rows;  ///< of it
  Combinations driven_P;    ///< nearest to P of those of the chassis as it moved
  std::vector<RowMatrix> row_derivatives;
};

[[nodiscard]] Comparison comparison_of(const Chassis& chassis, const Rows& rows, const Chassis& driven,
                                       const Rows& driven_rows, const Combinations& P,
                                       std::span<const Parameter> parameters);

/// Of readings of these variances, by all of which the robot made this motion: eq. 7.
[[nodiscard]] Contradiction contradiction_of(const Comparison& comparison, const Increment& sum,
                                             const Vector3& motion, const RowVector& variance,
                                             bool with_errors);

/// The nearest to `P` of those combinations of rows that no motion changes.
[[nodiscard]] Combinations nearest_null_space(const Combinations& P, const Rows& rows);

/// Variances of the readings of a motion, as parts of a longer one: without rounding, which cancels there.
/// That a steered wheel does not skid is a reading of its angle.
[[nodiscard]] RowVector noise_of(const Chassis& chassis, const Rows& rows, const Vector3& motion,
                                 double duration_s);

/// By all readings, each by its own noise: then the error of the motion is independent of what no motion
/// explains, and so is what is weighed and differentiated by it.
[[nodiscard]] Vector3 estimated_motion(const Chassis& chassis, const Rows& rows, const Increment& part);

/// Variances of the difference of two counts: of a whole window, for in between they cancel.
[[nodiscard]] RowVector rounding_of(const Chassis& chassis, const Rows& rows);

}  // namespace trundle::calibration
