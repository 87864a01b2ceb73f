#pragma once

#include <span>

#include "trundle/calibration/estimator.hpp"
#include "trundle/recording/recording.hpp"
#include "trundle/slam/smoothing/shown.hpp"

namespace trundle::slam {

/// A recording whose sightings are associated with landmarks.
struct AssociatedRecording {
  const Recording& recording;
  Run run;                         ///< its readings
  bool has_unidentified = false;   ///< some sightings bear no name
  ShownObservations observations;  ///< by step
  Trajectory path;                 ///< along which they were associated

  double duration_s() const { return path.poses.back().time_s - path.poses.front().time_s; }
};

/// What was found, and how well noise as the robot file has it explains what is left.
struct LandmarkFit {
  Estimate estimate;
  double scatter = 1.0;  ///< cost for each degree of freedom
};

/// Poses, landmarks and a robot's parameters from all recordings, each with a map of its own: Gauss–Newton
/// without prior in what can be told; in every round the motions are those of the robot found so far.
/// docs/theory/landmark-calibration.md. Throws CannotAnswer when nothing is seen, or sightings leave
/// something undetermined.
[[nodiscard]] LandmarkFit fit_landmarks(std::span<const AssociatedRecording> all, const Robot& nominal,
                                        std::span<const Parameter> parameters);

}  // namespace trundle::slam
