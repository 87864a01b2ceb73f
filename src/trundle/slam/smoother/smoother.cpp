#include "trundle/slam/smoother/smoother.hpp"

#include <algorithm>
#include <optional>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoother/hindsight.hpp"
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

TrackInput track_input(const SlamInput& input, const ShownObservations& shown, const SlamPrior& prior) {
  const std::vector<int> free = free_of(prior.systematic_sigma);
  TrackInput track{.observations = shown, .start = prior.start, .start_covariance = prior.start_covariance};
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

/// The recording as a smoothing problem, with what its sightings are said to show.
class Smoothing {
 public:
  Smoothing(const SlamInput& input, const ShownObservations& shown, const LandmarkSensor& sensor,
            const SmootherOptions& options)
      : options_(options),
        problem_(empty_problem(sensor, options)),
        track_(track_input(input, shown, options.prior), problem_) {
    if (track_.stations() == 0)
      throw CannotAnswer("nothing was seen whose landmark is known: nothing to smooth");
    minimiser_.emplace(problem_);
  }

  /// From the trajectory of a filter, which may have been lost.
  SmoothedSlam from_filtered(const Trajectory& start) {
    return result(minimum_from(problem_, track_.at_stations(start), *minimiser_, minimise_options()));
  }
  /// From one that is nearly right.
  SmoothedSlam from_smoothed(const Trajectory& start, std::size_t starts) {
    return result(
        {minimum_near(problem_, track_.at_stations(start), *minimiser_, minimise_options()), starts});
  }

  /// After either.
  Matrix2 difference_covariance(LandmarkId a, LandmarkId b) const {
    return minimiser_->difference_covariance(number_of(a), number_of(b));
  }

 private:
  MinimiseOptions minimise_options() const {
    return {.most_iterations = options_.most_iterations, .enough = options_.enough};
  }
  int number_of(LandmarkId id) const {
    const auto landmarks = track_.landmarks();
    return track_.first_landmark() + static_cast<int>(std::ranges::find(landmarks, id) - landmarks.begin());
  }
  SmoothedSlam result(const Found& found);

  SmootherOptions options_;
  SmoothingProblem problem_;
  Track track_;
  std::optional<Minimiser> minimiser_;
};

SmoothedSlam Smoothing::result(const Found& found) {
  const SmoothingState& state = found.minimum.state;
  if (!minimiser_->linearise(problem_, state))
    throw CannotAnswer("the sightings leave poses or landmarks undetermined");
  SmoothedSlam result;
  result.trajectory = track_.trajectory(state, *minimiser_);
  result.map = map_of(track_, problem_, state, *minimiser_);
  result.last = last_of(result.trajectory, state, *minimiser_, options_.prior.systematic_sigma);
  result.counts = {.poses = track_.stations(),
                   .sightings = problem_.sightings.size(),
                   .outliers = outliers_at(problem_, state),
                   .cost = found.minimum.cost,
                   .degrees_of_freedom = degrees_of_freedom(problem_),
                   .iterations = found.minimum.iterations,
                   .starts = found.starts,
                   .converged = found.minimum.converged};
  return result;
}

/// What the sightings show, and the smoothed trajectory and map if they do.
struct Explanation {
  ShownObservations shown;
  Smoothing smoothing;
  SmoothedSlam smoothed;
  double cost;  ///< docs/smoother.md, eq. 4 and 14
};

/// Asks again what sightings without names show, as long as that explains them better: first whether
/// landmarks are one and the same, all at once or else the clearest pair; then each instant for itself.
class Hindsight {
 public:
  Hindsight(const SlamInput& input, const LandmarkSensor& sensor, const SmootherOptions& options,
            Explanation first)
      : input_(input), sensor_(sensor), options_(options), best_(std::move(first)) {}

  SmoothedSlam improved() {
    for (int round = 0; round < kMostRounds; ++round) {
      const bool merged = merge_twins();
      if (!explain_again() && !merged) break;
    }
    best_.smoothed.shown = std::move(best_.shown);
    return std::move(best_.smoothed);
  }

 private:
  static constexpr int kMostRounds = 5;

  bool merge_twins() {
    const std::vector<LandmarkPair> twins =
        twins_in(best_.shown, best_.smoothed.map, sensor_, input_.first_nameless(),
                 [&](LandmarkId a, LandmarkId b) { return best_.smoothing.difference_covariance(a, b); });
    if (twins.empty()) return false;
    return is_better(with_merged(best_.shown, twins)) ||
           (twins.size() > 1 && is_better(with_merged(best_.shown, std::span(twins).first(1))));
  }
  bool explain_again() { return is_better(explained_again(best_.shown, input_, best_.smoothed, sensor_)); }

  /// Then it is the best from now on.
  bool is_better(ShownObservations shown) {
    if (say_the_same(shown, best_.shown)) return false;
    Smoothing smoothing(input_, shown, sensor_, options_);
    SmoothedSlam smoothed = smoothing.from_smoothed(best_.smoothed.trajectory, best_.smoothed.counts.starts);
    const double cost = smoothed.counts.cost + cost_of_explaining(shown, sensor_);
    if (cost >= best_.cost) return false;
    best_ = {std::move(shown), std::move(smoothing), std::move(smoothed), cost};
    return true;
  }

  const SlamInput& input_;
  const LandmarkSensor& sensor_;
  SmootherOptions options_;
  Explanation best_;
};

}  // namespace

SmoothedSlam smooth(const SlamInput& input, const LandmarkSensor& sensor, const SlamResult& filtered,
                    const SmootherOptions& options) {
  ShownObservations shown = shown_observations(input, filtered);
  Smoothing smoothing(input, shown, sensor, options);
  SmoothedSlam smoothed = smoothing.from_filtered(filtered.path ? *filtered.path : filtered.online);
  if (!input.has_nameless()) {
    smoothed.shown = std::move(shown);
    return smoothed;
  }
  const double cost = smoothed.counts.cost + cost_of_explaining(shown, sensor);
  Explanation first{std::move(shown), std::move(smoothing), std::move(smoothed), cost};
  return Hindsight(input, sensor, options, std::move(first)).improved();
}

}  // namespace trundle
