#pragma once

#include <optional>

#include "trundle/slam/smoothing/sensor_score.hpp"
#include "trundle/slam/smoothing/solver/smoothing_problem.hpp"

namespace trundle::slam {

class IncrementalSmoother;

/// How the minimisation went.
struct SmootherCounts {
  std::size_t poses = 0;  ///< at which something was seen: the unknowns; the others lie between them
  std::size_t sightings = 0;
  std::size_t outliers = 0;    ///< of them, those whose NIS is beyond the gate
  double cost = 0.0;           ///< docs/theory/smoother.md, eq. 4
  int degrees_of_freedom = 0;  ///< what the cost should be near
  int iterations = 0;          ///< of the start that was kept
  std::size_t starts = 0;      ///< from how many places it was started
  bool converged = false;
};

/// How well a smoother's solution explains what it was given.
struct SmootherFit {
  SmootherCounts counts;
  SensorScores sensor;  ///< what ranges and bearings err by in common
};

/// At a state, where `linearised` is; how the minimisation went is not said.
[[nodiscard]] SmootherFit fit_at(const SmoothingProblem& problem, const SmoothingState& state,
                                 const Minimiser& linearised);
/// Of the smoother that goes along, at the minimum where it stands: what is far from here was linearised when
/// that last mattered, and links as stiff as a turn on the spot feel it. A few linear systems of all of it.
/// Nothing where nothing was seen, that minimum is not reached, something is left undetermined, or older
/// poses were marginalised.
[[nodiscard]] std::optional<SmootherFit> fit_of(const IncrementalSmoother& smoother);

}  // namespace trundle::slam
