#pragma once

#include <span>

#include "trundle/calibration/solve/estimator.hpp"
#include "trundle/slam/smoothing/calibration/landmark_problem.hpp"
#include "trundle/slam/smoothing/sensor_score.hpp"

namespace trundle::slam {

/// What was found, and how well noise as the robot file has it explains what is left.
struct LandmarkFit {
  Estimate estimate;
  double scatter = 1.0;  ///< cost for each degree of freedom
  FreeColumns free;      ///< what could be determined
  SmoothingState state;  ///< with those parameters about the estimate's
  SensorScores sensor;   ///< what ranges and bearings err by in common beyond them; zero where not converged
};

/// Poses, landmarks and a robot's parameters from all recordings, each with a map of its own: Gauss–Newton
/// without prior in what can be determined; in every round the motions are those of the robot found so far.
/// docs/theory/landmark-calibration.md. Throws CannotAnswer when nothing is seen, or sightings leave
/// something undetermined. Without parameters: poses and landmarks alone.
[[nodiscard]] LandmarkFit fit_landmarks(std::span<const AssociatedRecording> all, const Robot& nominal,
                                        std::span<const Parameter> parameters);

}  // namespace trundle::slam
