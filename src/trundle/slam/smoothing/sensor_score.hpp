#pragma once

#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"

namespace trundle::slam {

class Minimiser;

/// What a systematic error of all readings would be that nothing was estimated of.
struct SensorScore {
  double value = 0.0;       ///< [m] or [rad]; 0 where nothing shows it
  double sigma = 0.0;       ///< 1σ, of readings that err independently
  double of_reading = 0.0;  ///< `value` in sigmas of one reading
};
struct SensorScores {
  SensorScore range;    ///< an offset of all ranges
  SensorScore bearing;  ///< likewise
  SensorScore depth;    ///< a larger depth_share
};

/// The score test [Rao 1948] at a minimum: what one step towards all of them would find, poses, map and
/// parameters giving way. `linearised` at that state. docs/theory/smoother.md, eq. 12a.
[[nodiscard]] SensorScores sensor_scores(const SmoothingProblem& problem, const SmoothingState& state,
                                         const Minimiser& linearised);

}  // namespace trundle::slam
