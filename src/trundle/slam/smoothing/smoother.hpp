#pragma once

#include "trundle/slam/slam.hpp"
#include "trundle/slam/smoothing/shown.hpp"
#include "trundle/slam/smoothing/smoother_fit.hpp"

namespace trundle::slam {

/// The odometry's systematic errors are unknown by so much where nothing else is said: travel and turning by
/// 5 % and 10 % of themselves, 0.05 rad/m.
inline const Vector3 kUsualShareSigma = {0.05, 0.1, 0.05};

/// Of the smoother.
struct SmootherOptions {
  /// Without systematic errors: those of the input, shares with kUsualShareSigma.
  SlamPrior prior = {};
  double gate = kDefaultGate;  ///< NIS beyond which a sighting has less weight than its square: an outlier
  int most_iterations = 100;
  double enough = 1e-4;  ///< the cost, a χ², that a further step is expected to gain
};

/// The most probable trajectory and map given everything that was seen, before and after.
struct SmoothedSlam {
  Trajectory trajectory;            ///< after each step, with covariance
  std::vector<MappedLandmark> map;  ///< those that were seen
  Eigen::MatrixXd map_covariance;   ///< of all of them, x and y of each
  PoseEstimate last;                ///< after the last step, with the odometry's systematic errors
  std::vector<BiasEstimate> bias;   ///< at each step: the gyro's, where there is one
  ShownObservations shown;          ///< which landmark each sighting shows, in the end
  SmootherCounts counts;
  SensorScores sensor;  ///< what ranges and bearings err by in common
};

/// Nonlinear least squares over all poses, landmarks and systematic errors, the gyro's bias as a walk, in the
/// frame of the prior's start (docs/theory/smoother.md), from what a filter found: from its path, which
/// sighting it took for which landmark. Sightings that it rejected count where it is known what they show;
/// what is an outlier is judged again. Throws CannotAnswer when nothing was seen.
[[nodiscard]] SmoothedSlam smooth(const SlamInput& input, const LandmarkSensor& sensor,
                                  const SlamResult& filtered, const SmootherOptions& options = {});

}  // namespace trundle::slam
