#include "trundle/slam/smoother/smoother.hpp"

#include <algorithm>
#include <optional>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoother/shown.hpp"
#include "trundle/slam/smoother/smoother_start.hpp"
#include "trundle/slam/smoother/track.hpp"

namespace trundle {
namespace {

/// Which of the three systematic errors are estimated.
std::vector<int> free_of(const Systematic& sigma) {
  std::vector<int> free;
  for (int i = 0; i < 3; ++i)
    if (sigma[i] > 0.0) free.push_back(i);
  return free;
}

TrackInput track_input(const SlamInput& input, const SlamResult& filtered, const SlamPrior& prior) {
  const std::vector<int> free = free_of(prior.systematic_sigma);
  TrackInput track{.observations = shown_observations(input, filtered),
                   .start = prior.start,
                   .start_covariance = prior.start_covariance};
  for (const SlamStep& step : input.steps) {
    track.time_s.push_back(step.time_s);
    track.motions.push_back(
        {step.motion.mean, step.motion.covariance, step.motion.by_systematic(Eigen::all, free)});
  }
  return track;
}

SmoothingProblem empty_problem(const LandmarkSensor& sensor, const SmootherOptions& options) {
  const Systematic& sigma = options.prior.systematic_sigma;
  const Eigen::VectorXd free = sigma(free_of(sigma));
  return {.sensor = sensor,
          .motions = {},
          .sightings = {},
          .parameter_information = free.cwiseAbs2().cwiseInverse(),
          .gate = options.gate};
}

std::vector<MappedLandmark> map_of(const Track& track, const SmoothingProblem& problem,
                                   const SmoothingState& state, const Minimiser& linearised) {
  std::vector<MappedLandmark> map;
  for (std::size_t i = 0; i < track.landmarks().size(); ++i) {
    const int landmark = track.first_landmark() + static_cast<int>(i);
    map.push_back({track.landmarks()[i], state.landmarks[static_cast<std::size_t>(landmark)],
                   linearised.landmark_covariance(landmark), 0});
  }
  for (const SightingLink& link : problem.sightings)
    ++map[static_cast<std::size_t>(link.landmark - track.first_landmark())].sightings;
  return map;
}

std::size_t outliers_at(const SmoothingProblem& problem, const SmoothingState& state) {
  return static_cast<std::size_t>(std::ranges::count_if(problem.sightings, [&](const SightingLink& link) {
    return sighting_residual(problem.sensor, link.observation,
                             state.poses[static_cast<std::size_t>(link.pose)],
                             state.landmarks[static_cast<std::size_t>(link.landmark)])
               .error.squaredNorm() > problem.gate;
  }));
}

PoseEstimate last_of(const Trajectory& trajectory, const SmoothingState& state, const Minimiser& linearised,
                     const Systematic& sigma) {
  PoseEstimate last{trajectory.poses.back().pose, trajectory.covariances.back()};
  const std::vector<int> free = free_of(sigma);
  const Eigen::MatrixXd covariance = linearised.parameter_covariance();
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    last.systematic[free[i]] = state.parameters[row];
    for (std::size_t j = 0; j < free.size(); ++j)
      last.systematic_covariance(free[i], free[j]) = covariance(row, static_cast<Eigen::Index>(j));
  }
  return last;
}

}  // namespace

SmoothedSlam smooth(const SlamInput& input, const LandmarkSensor& sensor, const SlamResult& filtered,
                    const SmootherOptions& options) {
  SmoothingProblem problem = empty_problem(sensor, options);
  const Track track(track_input(input, filtered, options.prior), problem);
  if (track.stations() == 0)
    throw CannotAnswer("nothing was seen whose landmark is known: nothing to smooth");
  Minimiser minimiser(problem);
  const Found found =
      minimum_from(problem, track.at_stations(filtered.path ? *filtered.path : filtered.online), minimiser,
                   {.most_iterations = options.most_iterations, .enough = options.enough});
  if (!minimiser.linearise(problem, found.minimum.state))
    throw CannotAnswer("the sightings leave poses or landmarks undetermined");

  SmoothedSlam result;
  const SmoothingState& state = found.minimum.state;
  result.trajectory = track.trajectory(state, minimiser);
  result.map = map_of(track, problem, state, minimiser);
  result.last = last_of(result.trajectory, state, minimiser, options.prior.systematic_sigma);
  result.counts = {.poses = track.stations(),
                   .sightings = problem.sightings.size(),
                   .outliers = outliers_at(problem, state),
                   .cost = found.minimum.cost,
                   .degrees_of_freedom = degrees_of_freedom(problem),
                   .iterations = found.minimum.iterations,
                   .starts = found.starts,
                   .converged = found.minimum.converged};
  return result;
}

}  // namespace trundle
