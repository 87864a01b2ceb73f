#pragma once

#include <string>
#include <vector>

#include "trundle/slam/smoothing/calibration/landmark_problem.hpp"

namespace trundle::slam {

/// Errors of neighbouring readings that are alike.
struct LastingError {
  std::string of;            ///< "ranges", "bearings", "travel", "turns" or "positions of the reference"
  double correlation = 0.0;  ///< of one and the next
  double spacing_s = 0.0;    ///< between them, median

  /// A mean of many readings is so many times as uncertain as if each erred for itself.
  [[nodiscard]] double of_means() const;
};

/// Of what a minimum leaves: of successive sightings of one landmark, and of successive motions. Those that
/// are beyond chance (three sigmas of it) and make a mean 1.2 times as uncertain.
/// docs/theory/landmark-noise.md, eq. 20.
[[nodiscard]] std::vector<LastingError> lasting_errors(const JointProblem& joint,
                                                       const SmoothingState& state);

}  // namespace trundle::slam
