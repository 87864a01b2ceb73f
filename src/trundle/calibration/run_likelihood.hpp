#pragma once

#include <span>

#include "trundle/calibration/information.hpp"
#include "trundle/calibration/run.hpp"
#include "trundle/chassis/parameter.hpp"

namespace trundle {

/// Standard deviations of a reference stream's errors, and by how much they count for more at the knots
/// because errors of neighbouring knots are alike.
struct ReferenceNoise {
  double position_m = 0.005;
  double heading_rad = 0.02;
  double position_persistence = 1.0;
  double heading_persistence = 1.0;

  Vector3 sigma() const { return {position_m, position_m, heading_rad}; }
  Vector3 sigma_at_knots() const {
    return sigma().cwiseProduct(Vector3(position_persistence, position_persistence, heading_persistence));
  }
};

/// One knot where odometry and reference disagree beyond belief.
struct OutlyingKnot {
  double time_s = 0.0;
  bool jump = false;  ///< the reference stays displaced: the run is continued from its new place
};

/// How far odometry and reference are apart at a knot, given what was known before it.
struct Innovation {
  double time_s = 0.0;
  double squared_mahalanobis = 0.0;
  Vector3 normalised = Vector3::Zero();  ///< each over its own sigma; zero where not measured
  int count = 0;                         ///< of scalars measured
};

/// What a run says about the parameters.
struct RunLikelihood {
  std::vector<Information> pieces;  ///< consecutive parts of the run, their residuals independent
  std::vector<OutlyingKnot> outliers;
  std::vector<Innovation> innovations;  ///< of the knots that are not outliers

  Information total() const;
};

struct LikelihoodOptions {
  ReferenceNoise reference_noise;
  int pieces = 1;
  double gyro_factor = 1.0;  ///< by which the robot's gyro noise is more than its readings'
  double gate = 1e9;         ///< knots with a larger squared Mahalanobis innovation are outliers
};

/// The exact likelihood of a run under white odometry noise and white reference noise, in innovation form: a
/// Kalman filter follows the reference, and each innovation with its sensitivity to the parameters, carried
/// through the integration in the same pass, is one independent residual. With little odometry noise it
/// compares whole runs, with much of it short stretches. docs/theory/calibration.md, eq. 3-6.
RunLikelihood stream_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                const LikelihoodOptions& options);

/// Where the body stands at the first knot, which the run must have: the mean of the reference over the time
/// that the robot stands there; without headings in the reference, heading by the course over the ground.
Pose2 body_at_start(const Run& run, const Robot& robot);

/// The likelihood of what was measured of the run as a whole (PartialReference).
RunLikelihood partial_likelihood(const Run& run, const Robot& robot, std::span<const Parameter> parameters,
                                 double gyro_factor = 1.0);

}  // namespace trundle
