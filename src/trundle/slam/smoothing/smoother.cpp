#include "trundle/slam/smoothing/smoother.hpp"

#include <algorithm>
#include <optional>

#include "trundle/io/error.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/counted_errors.hpp"
#include "trundle/slam/smoothing/re_association_search.hpp"
#include "trundle/slam/smoothing/shown.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/slam/smoothing/track.hpp"

namespace trundle::slam {
namespace {

SmoothingProblem empty_problem(const LandmarkSensor& sensor, const SmootherOptions& options,
                               const CountedErrors& systematic) {
  return {.sensors = {sensor},
          .motions = {},
          .sightings = {},
          .parameter_information = systematic.information(),
          .parameter_mean = systematic.mean(),
          .has_bias = systematic.has_bias,
          .gate = options.gate};
}

std::vector<MappedLandmark> map_of(const Track& track, const SmoothingProblem& problem,
                                   const SmoothingState& state, const Minimiser& linearised) {
  std::vector<MappedLandmark> map;
  for (std::size_t i = 0; i < track.landmarks().size(); ++i) {
    const int landmark = track.first_landmark() + static_cast<int>(i);
    map.push_back(
        {track.landmarks()[i], state.landmarks[nth(landmark)], linearised.landmark_covariance(landmark), 0});
  }
  for (const SightingLink& link : problem.sightings)
    ++map[nth(link.landmark - track.first_landmark())].sightings;
  return map;
}

/// The recording as a smoothing problem, with what its sightings are said to show.
class Smoothing {
 public:
  Smoothing(const SlamInput& input, const ShownObservations& shown, const LandmarkSensor& sensor,
            const SmootherOptions& options, const Systematic& reference)
      : options_(options),
        systematic_(counted_errors(input, options.prior, reference)),
        problem_(empty_problem(sensor, options, systematic_)),
        track_(track_input(input, shown, options.prior, systematic_), problem_, numbers_) {
    if (problem_.sightings.empty())
      throw CannotAnswer("nothing was seen whose landmark is known: nothing to smooth");
    minimiser_.emplace(problem_);
  }

  /// From the trajectory of a filter, which may have been lost.
  SmoothedSlam from_filtered(const Trajectory& start) {
    return result(
        minimum_from(problem_, track_.at_keyframes(start), *minimiser_, minimise_options(options_)));
  }
  /// From one that is nearly right.
  SmoothedSlam from_smoothed(const Trajectory& start, std::size_t starts) {
    return result(
        {minimum_near(problem_, track_.at_keyframes(start), *minimiser_, minimise_options(options_)),
         starts});
  }

  const LandmarkSensor& sensor() const { return problem_.sensors.front(); }

  /// After either.
  Eigen::MatrixXd map_covariance() const {
    return minimiser_->map_covariance(track_.first_landmark(), static_cast<int>(track_.landmarks().size()));
  }
  Matrix2 difference_covariance(LandmarkId a, LandmarkId b) const {
    return minimiser_->difference_covariance(number_of(a), number_of(b));
  }

 private:
  int number_of(LandmarkId id) const {
    const auto landmarks = track_.landmarks();
    return track_.first_landmark() + static_cast<int>(std::ranges::find(landmarks, id) - landmarks.begin());
  }
  SmoothedSlam result(const Found& found);

  SmootherOptions options_;
  CountedErrors systematic_;
  SmoothingProblem problem_;
  LandmarkNumbers numbers_;
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
  result.last.pose = result.trajectory.poses.back().pose;
  result.last.covariance = result.trajectory.covariances.back();
  add_systematic(state, *minimiser_, systematic_, static_cast<int>(state.poses.size()) - 1, result.last);
  result.bias = track_.biases(state, *minimiser_);
  for (BiasEstimate& bias : result.bias) bias.rad_s += systematic_.bias();
  const SmootherFit fit = fit_at(problem_, state, *minimiser_);
  result.sensor = fit.sensor;
  result.counts = fit.counts;
  result.counts.iterations = found.minimum.iterations;
  result.counts.starts = found.starts;
  result.counts.converged = found.minimum.converged;
  return result;
}

/// The explanation of a robot alone.
struct SmoothedExplanation {
  std::vector<ShownObservations> shown;  ///< by this one robot
  Smoothing smoothing;
  SmoothedSlam smoothed;
  double cost = smoothed.counts.cost + cost_of_explaining(robots(), smoothed.map);

  std::vector<ShownFromPath> robots() const {
    return {{shown.front(), smoothed.trajectory, smoothing.sensor()}};
  }
  std::span<const MappedLandmark> map() const { return smoothed.map; }
  Matrix2 difference_covariance(LandmarkId a, LandmarkId b) const {
    return smoothing.difference_covariance(a, b);
  }
};

}  // namespace

SmoothedSlam smooth(const SlamInput& input, const LandmarkSensor& sensor, const SlamResult& filtered,
                    const SmootherOptions& options) {
  ShownObservations shown = shown_observations(input, filtered);
  Smoothing smoothing(input, shown, sensor, options, filtered.last.systematic);
  SmoothedSlam smoothed = smoothing.from_filtered(filtered.path ? *filtered.path : filtered.online);
  if (!input.has_unidentified()) {
    smoothed.map_covariance = smoothing.map_covariance();
    smoothed.shown = std::move(shown);
    return smoothed;
  }
  const auto explain = [&](std::vector<ShownObservations> other, const SmoothedExplanation& best) {
    Smoothing again(input, other.front(), sensor, options, filtered.last.systematic);
    SmoothedSlam found = again.from_smoothed(best.smoothed.trajectory, best.smoothed.counts.starts);
    return SmoothedExplanation{std::move(other), std::move(again), std::move(found)};
  };
  const SlamInput* const inputs[] = {&input};
  SmoothedExplanation best =
      ReAssociation(inputs, explain,
                    SmoothedExplanation{{std::move(shown)}, std::move(smoothing), std::move(smoothed)})
          .improved();
  best.smoothed.map_covariance = best.smoothing.map_covariance();
  best.smoothed.shown = std::move(best.shown.front());
  return std::move(best.smoothed);
}

}  // namespace trundle::slam
