#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "trundle/calibration/likelihood/chassis_likelihood.hpp"
#include "trundle/calibration/likelihood/information.hpp"
#include "trundle/calibration/likelihood/own_sensitivity.hpp"
#include "trundle/calibration/problem/noise_levels.hpp"
#include "trundle/calibration/problem/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle::calibration {

/// One epoch where odometry and reference disagree by more than chance.
struct OutlyingEpoch {
  double time_s = 0.0;
  bool jump = false;  ///< the reference stays displaced: the run is continued from its new place
};

/// How far odometry and reference are apart at an epoch, given what was known before it.
struct Innovation {
  double time_s = 0.0;
  double squared_mahalanobis = 0.0;
  double log_determinant = 0.0;          ///< of its covariance
  Vector3 normalised = Vector3::Zero();  ///< each over its own sigma; zero where not measured
  int count = 0;                         ///< of scalars measured
};

/// What a run says about the parameters.
struct RunLikelihood {
  std::vector<Information> blocks;  ///< consecutive parts of the run, their residuals independent
  std::vector<OutlyingEpoch> outliers;
  std::vector<Innovation> innovations;  ///< of the epochs that are not outliers

  Information total() const;
};

/// What chassis_likelihood() is of.
struct RedundantReadings {
  const Robot& robot;  ///< contradicting_robot(), with rounding, which is that of a window
  ChassisLikelihoodOptions options;
};

struct LikelihoodOptions {
  ReferenceNoise reference_noise;
  int blocks = 1;  ///< into which the run is cut, one Information for each
  /// Of its readings alone; nothing: the robot's, which may also count what heading misses beyond it.
  std::optional<double> gyro_noise_rad_s_sqrt_hz = {};
  double gate = 1e9;  ///< epochs with a larger squared Mahalanobis innovation are outliers
  /// With the noise of its readings, where the robot's is one that a search is helped by; null: the robot's.
  const Chassis* readings = nullptr;
  bool with_noise = false;  ///< also Information::of_noise
  OwnMotion own = {};       ///< parameters behind all others
  /// Where it is given, what no motion explains of the run's readings is part of it.
  std::optional<RedundantReadings> redundant = {};
};

/// The exact likelihood of a run under white odometry noise and white reference noise, in innovation form: a
/// Kalman filter follows the reference, and each innovation with its sensitivity to the parameters, carried
/// through the integration in the same pass, is one independent residual. With little odometry noise it
/// compares whole runs, with much of it short stretches. docs/theory/calibration.md, eq. 3-6.
RunLikelihood stream_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                const LikelihoodOptions& options);

/// Where the body stands at an epoch, which the run must have: the mean of the reference over the time
/// that the robot stands there; without headings in the reference, heading by course_over_ground().
Pose2 body_at(const Run& run, std::size_t epoch, const Robot& robot);

/// The likelihood of what was measured of the run as a whole (PartialReference).
RunLikelihood partial_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                 const LikelihoodOptions& options);

}  // namespace trundle::calibration
