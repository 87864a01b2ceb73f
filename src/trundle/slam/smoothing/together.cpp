#include "trundle/slam/smoothing/together.hpp"

#include <algorithm>
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/counted_errors.hpp"
#include "trundle/slam/smoothing/placement.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
namespace {

// Beyond it a heading is not known: all headings alike have a σ of π/√3.
constexpr double kUnknownHeading_rad = 1.0;

/// All robots as one problem, and where the minimisation starts.
struct RobotsProblem {
  SmoothingProblem problem;
  std::vector<CountedErrors> errors = {};
  std::vector<Track> tracks = {};
  std::vector<LandmarkId> landmarks = {};  ///< by the problem's numbers
  Trajectory at_keyframes = {};
};

/// Systematic errors one robot after the other.
std::vector<CountedErrors> errors_of(std::span<const RobotRecording> robots) {
  std::vector<CountedErrors> errors;
  Eigen::Index column = 0;
  for (const RobotRecording& robot : robots) {
    errors.push_back(counted_errors(robot.input, robot.prior, robot.systematic));
    errors.back().first_column = column;
    column += errors.back().columns();
  }
  return errors;
}

SmoothingProblem empty_problem_of(std::span<const RobotRecording> robots,
                                  const std::vector<CountedErrors>& errors, const SmootherOptions& options) {
  const Eigen::Index count = errors.back().first_column + errors.back().columns();
  SmoothingProblem problem{.sensors = {},
                           .motions = {},
                           .sightings = {},
                           .parameter_information = Eigen::VectorXd(count),
                           .parameter_mean = Eigen::VectorXd(count),
                           .gate = options.gate};
  for (std::size_t i = 0; i < robots.size(); ++i) {
    problem.sensors.push_back(robots[i].sensor);
    problem.parameter_information.segment(errors[i].first_column, errors[i].columns()) =
        errors[i].information();
    problem.parameter_mean.segment(errors[i].first_column, errors[i].columns()) = errors[i].mean();
    problem.has_bias |= errors[i].has_bias;
  }
  problem.free_starts = static_cast<int>(robots.size()) - 1;
  return problem;
}

RobotsProblem problem_of(std::span<const RobotRecording> robots, std::span<const RobotSighting> seen,
                         const SmootherOptions& options) {
  std::vector<CountedErrors> errors = errors_of(robots);
  RobotsProblem all{.problem = empty_problem_of(robots, errors, options)};
  all.errors = std::move(errors);
  const std::vector<PlacedPath> placed = placed_paths(robots, seen, options);
  LandmarkNumbers numbers;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    SlamPrior prior = robots[i].prior;
    if (i > 0) prior.start = placed[i].start;
    if (i > 0) prior.start_covariance = free_start_covariance();
    TrackInput input = track_input(robots[i].input, robots[i].shown, prior, all.errors[i],
                                   all.problem.parameter_information.size());
    input.also_keyframes = meetings_of(i, seen);
    input.sensor = static_cast<int>(i);
    const Track& track = all.tracks.emplace_back(input, all.problem, numbers);
    const Trajectory keyframes = track.at_keyframes(placed[i].path);
    all.at_keyframes.poses.insert(all.at_keyframes.poses.end(), keyframes.poses.begin(),
                                  keyframes.poses.end());
    all.landmarks.insert(all.landmarks.end(), track.landmarks().begin(), track.landmarks().end());
  }
  for (const RobotSighting& sighting : seen)
    all.problem.robots_seen.push_back(link_of(sighting, robots,
                                              all.tracks[sighting.seer].pose_at(sighting.seer_step),
                                              all.tracks[sighting.seen].pose_at(sighting.seen_step)));
  return all;
}

/// What one robot shares may be a single point, about which it could stand anywhere.
void require_known_frames(std::span<const RobotRecording> robots, const RobotsProblem& all,
                          const Minimiser& linearised) {
  for (std::size_t i = 1; i < robots.size(); ++i) {
    const double variance = linearised.pose_covariance(all.tracks[i].first_pose())(2, 2);
    if (variance < kUnknownHeading_rad * kUnknownHeading_rad) continue;
    throw CannotAnswer(
        fmt::format("{}: what it shares with the other robots does not determine its pose among them: its "
                    "heading is known to ±{:.0f}° alone",
                    robots[i].name, degrees(std::sqrt(variance))));
  }
}

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

std::vector<MappedLandmark> joint_map_of(const RobotsProblem& all, const SmoothingState& state,
                                         const Minimiser& linearised) {
  std::vector<MappedLandmark> map;
  for (std::size_t i = 0; i < all.landmarks.size(); ++i)
    map.push_back(
        {all.landmarks[i], state.landmarks[i], linearised.landmark_covariance(static_cast<int>(i)), 0});
  for (const SightingLink& link : all.problem.sightings) ++map[nth(link.landmark)].sightings;
  return map;
}

}  // namespace

JointSlam smooth_together(std::span<const RobotRecording> robots, std::span<const RobotSighting> all_seen,
                          const SmootherOptions& options) {
  std::vector<RobotSighting> seen;
  std::ranges::copy_if(all_seen, std::back_inserter(seen),
                       [](const RobotSighting& one) { return is_valid(one.observation); });
  const RobotsProblem all = problem_of(robots, seen, options);
  Minimiser minimiser(all.problem);
  const Minimum minimum =
      minimum_near(all.problem, all.at_keyframes, minimiser,
                   {.most_iterations = options.most_iterations, .enough = options.enough});
  if (!minimiser.linearise(all.problem, minimum.state))
    throw CannotAnswer("the sightings leave poses or landmarks undetermined");
  require_known_frames(robots, all, minimiser);
  JointSlam joint;
  for (std::size_t i = 0; i < robots.size(); ++i)
    joint.robots.push_back(estimate_of(all.tracks[i], all.errors[i], minimum.state, minimiser));
  count_sightings(all, minimum.state, joint.robots);
  joint.map = joint_map_of(all, minimum.state, minimiser);
  joint.map_covariance = minimiser.map_covariance(0, static_cast<int>(all.landmarks.size()));
  joint.counts = {.poses = nth(all.problem.poses),
                  .sightings = all.problem.sightings.size() + all.problem.robots_seen.size(),
                  .cost = minimum.cost,
                  .degrees_of_freedom = degrees_of_freedom(all.problem),
                  .iterations = minimum.iterations,
                  .starts = 1,
                  .converged = minimum.converged};
  for (const RobotEstimate& robot : joint.robots)
    joint.counts.outliers += robot.outliers + robot.robot_outliers;
  return joint;
}

}  // namespace trundle::slam
