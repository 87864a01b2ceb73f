#pragma once

#include <optional>
#include <span>

#include "trundle/slam/smoothing/calibration/landmark_problem.hpp"

namespace trundle::slam {

/// Where the reference has the start of a path: the rigid motion that lays the path along it. Nothing where
/// it has no positions of it, or those of one place alone.
[[nodiscard]] std::optional<Pose2> start_by_reference(const Run& run, const Trajectory& path,
                                                      const Robot& robot);

/// What such paths miss the reference by, 1σ of x and of y [m]: where a search for what it errs by begins.
[[nodiscard]] double rough_position_sigma(std::span<const AssociatedRecording> all, const Robot& robot);

/// Adds to a problem where the reference has poses of a track, about a second apart, for neighbours err
/// alike. docs/theory/landmark-reference.md, eq. 13g.
void add_positions(const Run& run, const Track& track, const Robot& robot, double sigma_m,
                   SmoothingProblem& problem);

/// What they err by, 1σ of x and of y [m], by what is left of them at a state at which the problem was
/// linearised. Eq. 13h.
[[nodiscard]] double position_sigma(const SmoothingProblem& problem, const SmoothingState& state,
                                    const Minimiser& linearised);

}  // namespace trundle::slam
