#include "trundle/slam/smoothing/smoother_fit.hpp"

#include <algorithm>

#include "trundle/slam/smoothing/incremental_smoother.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"

namespace trundle::slam {
namespace {

std::size_t outliers_at(const SmoothingProblem& problem, const SmoothingState& state) {
  return static_cast<std::size_t>(std::ranges::count_if(problem.sightings, [&](const SightingLink& link) {
    return sighting_residual(problem, link, state).error.squaredNorm() > problem.gate;
  }));
}

}  // namespace

SmootherFit fit_at(const SmoothingProblem& problem, const SmoothingState& state,
                   const Minimiser& linearised) {
  return {.counts = {.poses = static_cast<std::size_t>(problem.poses),
                     .sightings = problem.sightings.size(),
                     .outliers = outliers_at(problem, state),
                     .cost = cost_of(problem, state),
                     .degrees_of_freedom = degrees_of_freedom(problem)},
          .sensor = sensor_scores(problem, state, linearised)};
}

std::optional<SmootherFit> fit_of(const IncrementalSmoother& smoother) {
  const SmoothingProblem& problem = smoother.problem();
  if (problem.sightings.empty() || smoother.has_marginalised()) return std::nullopt;
  Minimiser minimiser(problem);
  const Minimum minimum = minimiser.minimise(problem, smoother.state());
  if (!minimum.converged || !minimiser.linearise(problem, minimum.state)) return std::nullopt;
  SmootherFit fit = fit_at(problem, minimum.state, minimiser);
  fit.counts.iterations = minimum.iterations;
  fit.counts.converged = minimum.converged;
  return fit;
}

}  // namespace trundle::slam
