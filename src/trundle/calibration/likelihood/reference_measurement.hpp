#pragma once

#include <array>
#include <span>

#include <Eigen/Core>

#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"
#include "trundle/odometry/odometer.hpp"

namespace trundle::calibration {

/// One linearised measurement z = h(pose, p) + noise of the present pose; at most eight numbers.
struct ReferenceMeasurement {
  using Residual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1>;
  using Selection = Eigen::Matrix<double, Eigen::Dynamic, 3, 0, 8, 3>;
  using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, kMaxParameters>;
  using Weight = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8>;

  Residual innovation;
  Selection H;  ///< ∂h/∂pose
  Jacobian J;   ///< ∂h/∂p − ∂z/∂p, with the sensitivity of the pose included
  Residual variance;
  std::array<int, 8> component{};  ///< of (x, y, heading) in each row

  /// (H P Hᵀ + R)⁻¹ for a pose of covariance P.
  Weight weight(const Matrix3& P) const;
};

/// What the reference shows at an epoch of the body where odometry has it.
[[nodiscard]] ReferenceMeasurement measure(const ReferenceSample& sample, const Odometer& odometer,
                                           const Robot& robot, std::span<const Parameter> parameters,
                                           const ReferenceNoise& noise);

/// What the run as a whole was measured to be, as residuals of its end pose relative to its start.
[[nodiscard]] ReferenceMeasurement measure_end(const PartialReference& partial, const Odometer& odometer,
                                               const Robot& robot, std::span<const Parameter> parameters);

/// An odometer that starts, or starts again after a jump, where the reference is at an epoch: its mean over
/// the time that the robot stands there. Without headings in the reference it looks where
/// Run::start_heading_rad or course_over_ground() has it, to a radian. `knows_heading`: to nothing, for it is
/// a parameter.
[[nodiscard]] Odometer odometer_at_epoch(const Run& run, std::size_t epoch, const Robot& robot,
                                         std::span<const Parameter> parameters, const ReferenceNoise& noise,
                                         bool knows_heading = false);
/// Where the body looks at an epoch [rad], by how the reference moves over the next ones and the same point
/// of the robot by odometry: for references without heading.
[[nodiscard]] double course_over_ground(const Run& run, std::size_t epoch, const Robot& robot);
/// One that starts with the reference sensor at the origin.
[[nodiscard]] Odometer odometer_at_origin(const Robot& robot, std::span<const Parameter> parameters);

}  // namespace trundle::calibration
