#pragma once

#include <optional>
#include <span>

#include "trundle/slam/smoothing/calibration/landmark_problem.hpp"

namespace trundle::slam {

/// By what a reference's positions err, of x and of y, and by how much more where neighbours err alike.
struct PositionNoise {
  double sigma_m = 0.0;
  double persistence = 1.0;

  /// 1σ with which one counts among many.
  [[nodiscard]] double sigma_among_many_m() const { return sigma_m * persistence; }
};

/// Where the reference has the start of a path: the rigid motion that lays the path along it. Nothing where
/// it has no positions of it, or those of one place alone.
[[nodiscard]] std::optional<Pose2> start_by_reference(const Run& run, const Trajectory& path,
                                                      const Robot& robot);

/// What such a path misses the reference by, of all recordings that use it: where a search for the noise
/// begins.
[[nodiscard]] PositionNoise rough_position_noise(std::span<const AssociatedRecording> all,
                                                 const Robot& robot);

/// Adds to a problem where the reference has poses of a track, about a second apart, for neighbours err
/// alike. docs/theory/landmark-calibration.md, eq. 13g.
void add_positions(const Run& run, const Track& track, const Robot& robot, double sigma_m,
                   SmoothingProblem& problem);

/// By what is left of the problem's positions at a state at which it was linearised. Eq. 13h.
[[nodiscard]] PositionNoise position_noise(const SmoothingProblem& problem, const SmoothingState& state,
                                           const Minimiser& linearised);

}  // namespace trundle::slam
