#include "trundle/slam/smoothing/together.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/counted_errors.hpp"
#include "trundle/slam/smoothing/placement.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
namespace {

// Beyond it a heading is not known: all headings alike have a σ of π/√3.
constexpr double kUnknownHeading_rad = 1.0;
// Starts of a robot that could lie otherwise: a descent finds its way from an eighth of a turn and more.
constexpr int kTurns = 8;
// Of two minima one is wrong with more than one in a thousand where their costs, χ², differ by less.
const double kAmbiguousCost = 2.0 * std::log(1e3);

/// All robots as one problem, and where the minimisation starts.
struct RobotsProblem {
  SmoothingProblem problem;
  std::vector<CountedErrors> errors = {};
  std::vector<Track> tracks = {};
  std::vector<LandmarkId> landmarks = {};  ///< by the problem's numbers
  std::vector<PlacedPath> placed = {};     ///< where the minimisation starts
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
  all.placed = placed_paths(robots, seen, options);
  LandmarkNumbers numbers;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    SlamPrior prior = robots[i].prior;
    if (i > 0) prior.start = all.placed[i].start;
    if (i > 0) prior.start_covariance = free_start_covariance();
    TrackInput input = track_input(robots[i].input, robots[i].shown, prior, all.errors[i],
                                   all.problem.parameter_information.size());
    input.also_keyframes = meetings_of(i, seen);
    input.sensor = static_cast<int>(i);
    const Track& track = all.tracks.emplace_back(input, all.problem, numbers);
    all.landmarks.insert(all.landmarks.end(), track.landmarks().begin(), track.landmarks().end());
  }
  for (const RobotSighting& sighting : seen)
    all.problem.robots_seen.push_back(link_of(sighting, robots,
                                              all.tracks[sighting.seer].pose_at(sighting.seer_step),
                                              all.tracks[sighting.seen].pose_at(sighting.seen_step)));
  return all;
}

Trajectory at_keyframes(const std::vector<Track>& tracks, const std::vector<PlacedPath>& placed) {
  Trajectory all;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Trajectory keyframes = tracks[i].at_keyframes(placed[i].path);
    all.poses.insert(all.poses.end(), keyframes.poses.begin(), keyframes.poses.end());
  }
  return all;
}

/// Where the search ended from one start.
struct RobotsMinimum {
  Minimum minimum;
  std::size_t turned = 0;  ///< the robot that was laid elsewhere
};

/// From where all are laid, and from where each that shares too little to contradict it is turned; the lowest
/// first. Costs are right to `enough`: of equal ones that from where all are laid.
std::vector<RobotsMinimum> minima_of(std::span<const RobotRecording> robots,
                                     std::span<const RobotSighting> seen, const RobotsProblem& all,
                                     Minimiser& minimiser, const SmootherOptions& options) {
  const auto from = [&](const std::vector<PlacedPath>& placed) {
    return minimum_near(all.problem, at_keyframes(all.tracks, placed), minimiser,
                        {.most_iterations = options.most_iterations, .enough = options.enough});
  };
  std::vector<RobotsMinimum> minima = {{from(all.placed)}};
  for (std::size_t i = 0; i < robots.size(); ++i)
    for (int k = 1; k < kTurns && all.placed[i].shared < kContradicting; ++k)
      minima.push_back({from(placed_paths(robots, seen, options, Turned{i, 2.0 * kPi * k / kTurns})), i});
  const auto lowest =
      std::ranges::min_element(minima, {}, [](const RobotsMinimum& one) { return one.minimum.cost; });
  if (lowest->minimum.cost < minima.front().minimum.cost - options.enough) std::swap(minima.front(), *lowest);
  return minima;
}

/// The sightings alone determine each robot's own poses and landmarks: what is left is how robots stand to
/// one another.
[[noreturn]] void throw_undetermined(std::span<const RobotRecording> robots, const RobotsProblem& all) {
  const auto least_sure = std::ranges::min_element(all.placed, {}, &PlacedPath::shared);
  throw CannotAnswer(fmt::format(
      "{}: what it shares with the other robots does not determine its pose among them: all of it lies in "
      "one place, or was seen from one",
      robots[static_cast<std::size_t>(least_sure - all.placed.begin())].name));
}

/// Whether some pose lies where the covariance at the lowest minimum says that it does not.
bool is_elsewhere(const SmoothingState& other, const SmoothingState& lowest, const Minimiser& linearised) {
  const double limit = chi_squared_limit(1e-3, 3.0);
  for (std::size_t i = 0; i < lowest.poses.size(); ++i) {
    const Pose2 by = lowest.poses[i].inverse() * other.poses[i];
    const Vector3 e(by.x, by.y, wrap_angle(by.heading));
    const Matrix3 covariance = linearised.pose_covariance(static_cast<int>(i)).topLeftCorner<3, 3>();
    if (e.dot(inverse_of(covariance) * e) > limit) return true;
  }
  return false;
}

std::string text_of(const Pose2& pose) {
  return fmt::format("x {:.2f} m, y {:.2f} m, heading {:.0f}°", pose.x, pose.y,
                     degrees(wrap_angle(pose.heading)));
}

/// Two places may explain what a robot shares equally well.
void require_one_minimum(std::span<const RobotRecording> robots, const RobotsProblem& all,
                         const std::vector<RobotsMinimum>& minima, const Minimiser& linearised) {
  const SmoothingState& lowest = minima.front().minimum.state;
  for (const RobotsMinimum& other : minima) {
    if (other.minimum.cost - minima.front().minimum.cost > kAmbiguousCost) continue;
    if (!is_elsewhere(other.minimum.state, lowest, linearised)) continue;
    const std::size_t robot = std::max(other.turned, minima.front().turned);
    const auto first = nth(all.tracks[robot].first_pose());
    throw CannotAnswer(fmt::format(
        "{}: ambiguous: what it shares with the other robots fits it at {} and as well at {}, "
        "where it first saw something: more landmarks that both see would tell",
        robots[robot].name, text_of(lowest.poses[first]), text_of(other.minimum.state.poses[first])));
  }
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
  const std::vector<RobotsMinimum> minima = minima_of(robots, seen, all, minimiser, options);
  const Minimum& minimum = minima.front().minimum;
  if (!minimiser.linearise(all.problem, minimum.state)) throw_undetermined(robots, all);
  require_known_frames(robots, all, minimiser);
  require_one_minimum(robots, all, minima, minimiser);
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
                  .starts = minima.size(),
                  .converged = minimum.converged};
  for (const RobotEstimate& robot : joint.robots)
    joint.counts.outliers += robot.outliers + robot.robot_outliers;
  return joint;
}

}  // namespace trundle::slam
