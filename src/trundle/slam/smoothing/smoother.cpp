#include "trundle/slam/smoothing/smoother.hpp"

#include <algorithm>
#include <optional>

#include "trundle/io/error.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/counted_errors.hpp"
#include "trundle/slam/smoothing/re_association.hpp"
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
    return result(minimum_from(problem_, track_.at_keyframes(start), *minimiser_, minimise_options()));
  }
  /// From one that is nearly right.
  SmoothedSlam from_smoothed(const Trajectory& start, std::size_t starts) {
    return result(
        {minimum_near(problem_, track_.at_keyframes(start), *minimiser_, minimise_options()), starts});
  }

  /// After either.
  Eigen::MatrixXd map_covariance() const {
    return minimiser_->map_covariance(track_.first_landmark(), static_cast<int>(track_.landmarks().size()));
  }
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

/// What the sightings show, and the smoothed trajectory and map if they do.
struct Explanation {
  ShownObservations shown;
  Smoothing smoothing;
  SmoothedSlam smoothed;
  double cost;  ///< docs/theory/smoother.md, eq. 4; docs/theory/re-association.md, eq. 14
};

/// Asks again what sightings without names show, as long as that explains them better: first whether
/// landmarks are one and the same, all at once or else the clearest pair; then each instant for itself.
class ReAssociation {
 public:
  ReAssociation(const SlamInput& input, const LandmarkSensor& sensor, const SmootherOptions& options,
                Systematic reference, Explanation first)
      : input_(input),
        sensor_(sensor),
        options_(options),
        reference_(std::move(reference)),
        best_(std::move(first)) {}

  SmoothedSlam improved() {
    for (int round = 0; round < kMostRounds; ++round) {
      const bool merged = merge_duplicates();
      if (!reassociate() && !merged) break;
    }
    best_.smoothed.map_covariance = best_.smoothing.map_covariance();
    best_.smoothed.shown = std::move(best_.shown);
    return std::move(best_.smoothed);
  }

 private:
  /// Each round has lowered the cost; what is still to gain after some is not worth another smoothing.
  static constexpr int kMostRounds = 5;

  bool merge_duplicates() {
    const std::vector<LandmarkPair> duplicates = duplicates_in(
        best_.shown, best_.smoothed.map, sensor_, input_.first_unidentified(),
        [&](LandmarkId a, LandmarkId b) { return best_.smoothing.difference_covariance(a, b); });
    if (duplicates.empty()) return false;
    return is_better(with_merged(best_.shown, duplicates)) ||
           (duplicates.size() > 1 && is_better(with_merged(best_.shown, std::span(duplicates).first(1))));
  }
  bool reassociate() { return is_better(reassociated(best_.shown, input_, best_.smoothed, sensor_)); }

  /// Then it is the best from now on.
  bool is_better(ShownObservations shown) {
    if (are_same_associations(shown, best_.shown)) return false;
    Smoothing smoothing(input_, shown, sensor_, options_, reference_);
    SmoothedSlam smoothed = smoothing.from_smoothed(best_.smoothed.trajectory, best_.smoothed.counts.starts);
    const double cost = smoothed.counts.cost + cost_of_explaining(shown, smoothed, sensor_);
    if (cost >= best_.cost) return false;
    best_ = {std::move(shown), std::move(smoothing), std::move(smoothed), cost};
    return true;
  }

  const SlamInput& input_;
  const LandmarkSensor& sensor_;
  SmootherOptions options_;
  Systematic reference_;
  Explanation best_;
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
  const double cost = smoothed.counts.cost + cost_of_explaining(shown, smoothed, sensor);
  Explanation first{std::move(shown), std::move(smoothing), std::move(smoothed), cost};
  return ReAssociation(input, sensor, options, filtered.last.systematic, std::move(first)).improved();
}

}  // namespace trundle::slam
