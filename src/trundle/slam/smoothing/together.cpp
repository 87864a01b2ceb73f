#include "trundle/slam/smoothing/together.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/re_association_search.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/together/robots_minimum.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
namespace {

/// What the sightings of landmarks or of robots leave.
struct Residuals {
  std::vector<double> squared = {};
  std::size_t outliers = 0;

  void add(double one, double gate) {
    squared.push_back(one);
    outliers += one > gate ? 1 : 0;
  }
  double median_squared() const { return squared.empty() ? 0.0 : median(squared); }
};

void count_sightings(const RobotsProblem& all, const SmoothingState& state,
                     std::vector<RobotEstimate>& robots) {
  const SmoothingProblem& problem = all.problem;
  std::vector<Residuals> of_landmarks(robots.size()), of_robots(robots.size());
  std::vector<std::set<int>> landmarks(robots.size());
  for (const SightingLink& link : problem.sightings) {
    of_landmarks[nth(link.sensor)].add(sighting_residual(problem, link, state).error.squaredNorm(),
                                       problem.gate);
    landmarks[nth(link.sensor)].insert(link.landmark);
  }
  for (const RobotLink& link : problem.robots_seen)
    of_robots[nth(link.sensor)].add(robot_residual(problem, link, state).error.squaredNorm(), problem.gate);
  for (std::size_t i = 0; i < robots.size(); ++i) {
    robots[i].landmarks = landmarks[i].size();
    robots[i].sightings = of_landmarks[i].squared.size();
    robots[i].outliers = of_landmarks[i].outliers;
    robots[i].nis = of_landmarks[i].median_squared();
    robots[i].robot_sightings = of_robots[i].squared.size();
    robots[i].robot_outliers = of_robots[i].outliers;
    robots[i].robot_nis = of_robots[i].median_squared();
  }
}

RobotEstimate estimate_of(const Track& track, const CountedErrors& errors, const SmoothingState& state,
                          const Minimiser& linearised) {
  RobotEstimate robot{.trajectory = track.trajectory(state, linearised)};
  robot.last.pose = robot.trajectory.poses.back().pose;
  robot.last.covariance = robot.trajectory.covariances.back();
  robot.poses = track.keyframes();
  const int last = track.first_pose() + static_cast<int>(track.keyframes()) - 1;
  add_systematic(state, linearised, errors, last, robot.last);
  if (!errors.has_bias) return robot;
  robot.bias = track.biases(state, linearised);
  for (BiasEstimate& bias : robot.bias) bias.rad_s += errors.bias();
  return robot;
}

void add_metres(const RobotsProblem& all, const SmoothingState& state, const Minimiser& linearised,
                std::vector<RobotEstimate>& robots) {
  const Eigen::VectorXd metres = all.metres * state.parameters;
  const Eigen::MatrixXd covariance = all.metres * linearised.parameter_covariance() * all.metres.transpose();
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    robots[i].metre = metres[k];
    robots[i].metre_sigma = std::sqrt(std::max(0.0, covariance(k, k)));
  }
}

std::vector<MappedLandmark> joint_map_of(const RobotsProblem& all, const SmoothingState& state,
                                         const Minimiser& linearised) {
  std::vector<MappedLandmark> map;
  for (std::size_t i = 0; i < all.landmarks.size(); ++i)
    map.push_back(
        {all.landmarks[i], state.landmarks[i], linearised.landmark_covariance(static_cast<int>(i)), 0});
  for (const SightingLink& link : all.problem.sightings) ++map[nth(link.landmark)].sightings;
  return map;
}

/// Most probable paths and map of all robots together, if their sightings show what is said.
struct TeamExplanation {
  std::vector<ShownObservations> shown;  ///< by each robot
  RobotsProblem all;
  Minimiser linearised;  ///< at the minimum
  Minimum minimum;
  std::vector<RobotEstimate> estimates = {};
  std::vector<MappedLandmark> landmarks = {};
  double cost = std::numeric_limits<double>::infinity();  ///< until it is asked for

  std::vector<ShownFromPath> robots() const {
    std::vector<ShownFromPath> robots;
    for (std::size_t i = 0; i < shown.size(); ++i)
      robots.push_back({shown[i], estimates[i].trajectory, all.problem.sensors[i]});
    return robots;
  }
  std::span<const MappedLandmark> map() const { return landmarks; }
  Matrix2 difference_covariance(LandmarkId a, LandmarkId b) const {
    return linearised.difference_covariance(number_of(a), number_of(b));
  }

  /// Where it was linearised.
  void add_estimates() {
    for (std::size_t i = 0; i < shown.size(); ++i)
      estimates.push_back(estimate_of(all.tracks[i], all.errors[i], minimum.state, linearised));
    landmarks = joint_map_of(all, minimum.state, linearised);
  }
  double cost_of_all() const { return minimum.cost + cost_of_explaining(robots(), landmarks); }

 private:
  int number_of(LandmarkId id) const {
    return static_cast<int>(std::ranges::find(all.landmarks, id) - all.landmarks.begin());
  }
};

bool has_unidentified(std::span<const RobotRecording> robots) {
  return std::ranges::any_of(robots,
                             [](const RobotRecording& robot) { return robot.input.has_unidentified(); });
}

/// What sightings without names show is asked again, of all robots' landmarks: those of one may be another's.
TeamExplanation reassociated(std::span<const RobotRecording> robots, std::span<const RobotSighting> seen,
                             const SmootherOptions& options, TeamExplanation first) {
  std::vector<const SlamInput*> inputs;
  for (const RobotRecording& robot : robots) inputs.push_back(&robot.input);
  const auto explain = [&](std::vector<ShownObservations> shown, const TeamExplanation& best) {
    std::vector<PlacedPath> placed;
    for (std::size_t i = 0; i < robots.size(); ++i)
      placed.push_back(path_from_start(robots[i], best.estimates[i].trajectory));
    RobotsProblem all = problem_of(robots, seen, shown, std::move(placed), options);
    Minimiser minimiser(all.problem);
    Minimum minimum =
        minimum_near(all.problem, all.at_keyframes(all.placed), minimiser, minimise_options(options));
    TeamExplanation there{std::move(shown), std::move(all), std::move(minimiser), std::move(minimum)};
    if (!there.linearised.linearise(there.all.problem, there.minimum.state)) return there;
    there.add_estimates();
    there.cost = there.cost_of_all();
    return there;
  };
  first.cost = first.cost_of_all();
  return ReAssociation(inputs, explain, std::move(first)).improved();
}

}  // namespace

JointSlam smooth_together(std::span<const RobotRecording> robots, std::span<const RobotSighting> all_seen,
                          const SmootherOptions& options) {
  std::vector<RobotSighting> seen;
  std::ranges::copy_if(all_seen, std::back_inserter(seen),
                       [](const RobotSighting& one) { return is_valid(one.observation); });
  std::vector<ShownObservations> shown;
  for (const RobotRecording& robot : robots) shown.push_back(robot.shown);
  RobotsProblem all = problem_of(robots, seen, shown, placed_paths(robots, seen, options), options);
  Minimiser minimiser(all.problem);
  std::vector<RobotsMinimum> minima = minima_of(robots, seen, all, minimiser, options);
  require_known_frames(robots, all, minima, minimiser);
  TeamExplanation best{std::move(shown), std::move(all), std::move(minimiser),
                       std::move(minima.front().minimum)};
  best.add_estimates();
  if (has_unidentified(robots)) best = reassociated(robots, seen, options, std::move(best));

  const SmoothingProblem& problem = best.all.problem;
  JointSlam joint{std::move(best.estimates), std::move(best.landmarks), {}, {}};
  count_sightings(best.all, best.minimum.state, joint.robots);
  joint.map_covariance = best.linearised.map_covariance(0, static_cast<int>(joint.map.size()));
  joint.counts = {.poses = nth(problem.poses),
                  .sightings = problem.sightings.size() + problem.robots_seen.size(),
                  .cost = best.minimum.cost,
                  .degrees_of_freedom = degrees_of_freedom(problem),
                  .iterations = best.minimum.iterations,
                  .starts = minima.size(),
                  .converged = best.minimum.converged};
  add_metres(best.all, best.minimum.state, best.linearised, joint.robots);
  for (const RobotEstimate& robot : joint.robots)
    joint.counts.outliers += robot.outliers + robot.robot_outliers;
  return joint;
}

}  // namespace trundle::slam
