#pragma once

#include <span>
#include <vector>

#include "trundle/slam/smoothing/counted_errors.hpp"
#include "trundle/slam/smoothing/together.hpp"
#include "trundle/slam/smoothing/together/placement.hpp"
#include "trundle/slam/smoothing/track.hpp"

namespace trundle::slam {

/// All robots as one problem, and where the minimisation starts.
struct RobotsProblem {
  SmoothingProblem problem;
  std::vector<CountedErrors> errors = {};
  std::vector<Track> tracks = {};
  std::vector<LandmarkId> landmarks = {};  ///< by the problem's numbers
  std::vector<PlacedPath> placed = {};     ///< where the minimisation starts
  Eigen::MatrixXd metres = {};             ///< what each robot's metre is off by, by the parameters

  /// The problem's poses where robots are placed so.
  [[nodiscard]] Trajectory at_keyframes(const std::vector<PlacedPath>& paths) const;
};

/// Where each robot's sightings of landmarks show what is said, and the minimisation starts from such paths.
[[nodiscard]] RobotsProblem problem_of(std::span<const RobotRecording> robots,
                                       std::span<const RobotSighting> seen,
                                       std::span<const ShownObservations> shown,
                                       std::vector<PlacedPath> placed, const SmootherOptions& options);

}  // namespace trundle::slam
