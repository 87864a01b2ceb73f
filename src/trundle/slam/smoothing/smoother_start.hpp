#pragma once

#include "trundle/geometry/trajectory.hpp"
#include "trundle/slam/smoothing/smoother.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"

namespace trundle::slam {

/// Of a smoother's minimisations.
[[nodiscard]] inline MinimiseOptions minimise_options(const SmootherOptions& options) {
  return {.most_iterations = options.most_iterations, .enough = options.enough};
}

/// Two for each sighting, of a robot too, and each position, less two for each landmark and three for each
/// track whose start is free, one for each reading of the bias: what the cost is near when the noise is as it
/// is said to be.
[[nodiscard]] int degrees_of_freedom(const SmoothingProblem& problem);

/// Where several sightings put a landmark: the median of each coordinate.
class MedianPlace {
 public:
  void add(const Vector2& place) {
    x_.push_back(place.x());
    y_.push_back(place.y());
  }
  /// Once; of at least one.
  [[nodiscard]] Vector2 take();

 private:
  std::vector<double> x_, y_;
};

/// The landmarks as seen from given poses: the median of where their sightings put them.
[[nodiscard]] std::vector<Vector2> landmarks_seen_from(const SmoothingProblem& problem,
                                                       const std::vector<Pose2>& poses);

/// The minimum near a state: first of the problem eased, then of the problem itself.
Minimum minimum_near(const SmoothingProblem& problem, SmoothingState start, Minimiser& minimiser,
                     const MinimiseOptions& options);
/// The minimum near a trajectory of the problem's poses.
Minimum minimum_near(const SmoothingProblem& problem, const Trajectory& at_keyframes, Minimiser& minimiser,
                     const MinimiseOptions& options);

struct Found {
  Minimum minimum;
  std::size_t starts = 0;
};

/// A start without a filter: the odometry, a few poses at a time, each time with the minimum of all so far.
/// The problem's landmarks are numbered in the order in which they are first seen.
[[nodiscard]] SmoothingState grown_from_odometry(const SmoothingProblem& problem);

/// The same from a state of the first poses: the others are appended. Every link is from the pose before its
/// own, or from one that is known, and motions[i] leads to pose i.
[[nodiscard]] SmoothingState grown_from(const SmoothingProblem& problem, SmoothingState state);

/// The lowest minimum found from a trajectory of the problem's poses; and from the odometry, where the first
/// leaves more than noise explains. docs/theory/smoother.md, section 'Where to start'.
Found minimum_from(const SmoothingProblem& problem, const Trajectory& at_keyframes, Minimiser& minimiser,
                   const MinimiseOptions& options);

}  // namespace trundle::slam
