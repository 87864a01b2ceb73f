#include "trundle/slam/smoothing/smoother_start.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/statistics/distribution.hpp"
#include "trundle/statistics/median.hpp"

namespace trundle::slam {
namespace {

// Times the gate. While it grows the run ends far from where it should, and a sighting there is no outlier
// yet: one is 100 times as far away as an outlier, in its σ.
constexpr double kGateWhileGrowing = 1e4;
// Whatever is left of the cost is left to the next growth, and to the minimisation that follows the last.
constexpr MinimiseOptions kWhileGrowing{.most_iterations = 15, .enough = 1.0};
// By one pose in so many, and by one at least: a growth adds the error of a fifth of the way, and n poses
// take log n / log 1.2 minimisations, together as long as six of the whole run.
constexpr int kGrowth = 5;
// Probability with which the cost of consistent noise is above the limit.
constexpr double kNoiseTail = 1e-3;

SmoothingState state_at(const SmoothingProblem& problem, const Trajectory& at_keyframes) {
  SmoothingState state;
  for (const StampedPose& stamped : at_keyframes.poses) state.poses.push_back(stamped.pose);
  state.landmarks = landmarks_seen_from(problem, state.poses);
  state.parameters = Eigen::VectorXd::Zero(problem.parameter_information.size());
  return state;
}

/// The first poses of a problem, with what was seen from them.
SmoothingProblem beginning_of(const SmoothingProblem& problem, int poses) {
  SmoothingProblem part{.sensors = problem.sensors,
                        .poses = poses,
                        .motions = {},
                        .sightings = {},
                        .parameter_information = problem.parameter_information,
                        .parameter_mean = problem.parameter_mean,
                        .has_bias = problem.has_bias,
                        .gate = kGateWhileGrowing * problem.gate,
                        .sensor_errors = problem.sensor_errors};
  for (const BiasLink& link : problem.bias_readings)
    if (link.pose < poses) part.bias_readings.push_back(link);
  for (const PositionLink& link : problem.positions)
    if (link.pose < poses) part.positions.push_back(link);
  for (const MotionLink& link : problem.motions)
    if (link.to < poses) part.motions.push_back(link);
  for (const RobotLink& link : problem.robots_seen)
    if (link.pose < poses && link.seen < poses) part.robots_seen.push_back(link);
  for (const SightingLink& link : problem.sightings) {
    if (link.pose >= poses) continue;
    part.sightings.push_back(link);
    part.landmarks = std::max(part.landmarks, link.landmark + 1);
  }
  return part;
}

/// Where the odometry takes the robot from what is known: poses up to `poses`.
void extend(const SmoothingProblem& part, SmoothingState& state) {
  for (std::size_t i = state.poses.size(); i < part.motions.size(); ++i) {
    const MotionLink& link = part.motions[i];
    const KnownStart from = start_of(link, state);
    const Vector3 effect = link.by_parameters * state.parameters + link.by_bias * from.bias;
    state.poses.push_back(from.pose * link.mean * exp(Twist2::from(effect)));
    if (part.has_bias) state.biases.push_back(from.bias);
  }
  const std::vector<Vector2> seen = landmarks_seen_from(part, state.poses);
  state.landmarks.insert(state.landmarks.end(),
                         seen.begin() + static_cast<std::ptrdiff_t>(state.landmarks.size()), seen.end());
}

/// The problem with motions that may also end beside their line, by what their turn's error makes of their
/// length's. Where a robot hardly skids, its poses are bound to a narrow curved valley, along which a descent
/// takes small steps; here it is wide enough for large ones.
SmoothingProblem eased(const SmoothingProblem& problem) {
  SmoothingProblem eased = problem;
  for (MotionLink& link : eased.motions) {
    Eigen::Matrix4d Q = link.information.inverse();
    Q.diagonal() += Q(2, 2) * Eigen::Vector4d(Q(1, 1), Q(0, 0), 0.0, 0.0);
    link.information = Q.inverse();
  }
  return eased;
}

/// χ² with so many degrees of freedom is above the cost with a probability of more than kNoiseTail.
bool is_explained_by_noise(const SmoothingProblem& problem, const Minimum& minimum) {
  const double freedom = degrees_of_freedom(problem);
  return minimum.converged && minimum.cost <= chi_squared_limit(kNoiseTail, std::max(freedom, 1.0));
}

}  // namespace

Minimum minimum_near(const SmoothingProblem& problem, SmoothingState start, Minimiser& minimiser,
                     const MinimiseOptions& options) {
  Minimum rough = minimiser.minimise(eased(problem), std::move(start), options);
  Minimum minimum = minimiser.minimise(problem, std::move(rough.state), options);
  minimum.iterations += rough.iterations;
  return minimum;
}

SmoothingState grown_from_odometry(const SmoothingProblem& problem) {
  SmoothingState nothing;
  nothing.parameters = Eigen::VectorXd::Zero(problem.parameter_information.size());
  return grown_from(problem, std::move(nothing));
}

SmoothingState grown_from(const SmoothingProblem& problem, SmoothingState state) {
  const int known = static_cast<int>(state.poses.size());
  for (int poses = known; poses < problem.poses;) {
    poses = std::min(problem.poses, poses + std::max(1, (poses - known) / kGrowth));
    const SmoothingProblem part = beginning_of(problem, poses);
    extend(part, state);
    state = Minimiser(part).minimise(part, std::move(state), kWhileGrowing).state;
  }
  return state;
}

int degrees_of_freedom(const SmoothingProblem& problem) {
  const std::size_t seen = problem.sightings.size() + problem.robots_seen.size() + problem.positions.size();
  return 2 * (static_cast<int>(seen) - problem.landmarks) - 3 * problem.free_starts +
         static_cast<int>(problem.bias_readings.size()) + problem.parameter_evidence.count;
}

Vector2 MedianPlace::take() {
  return {median(std::move(x_)), median(std::move(y_))};
}

std::vector<Vector2> landmarks_seen_from(const SmoothingProblem& problem, const std::vector<Pose2>& poses) {
  std::vector<MedianPlace> places(nth(problem.landmarks));
  for (const SightingLink& link : problem.sightings)
    places[nth(link.landmark)].add(sighted_landmark(poses[nth(link.pose)],
                                                    problem.sensors[nth(link.sensor)].body_from_sensor,
                                                    link.observation)
                                       .in_world);
  std::vector<Vector2> landmarks;
  for (MedianPlace& place : places) landmarks.push_back(place.take());
  return landmarks;
}

Minimum minimum_near(const SmoothingProblem& problem, const Trajectory& at_keyframes, Minimiser& minimiser,
                     const MinimiseOptions& options) {
  return minimum_near(problem, state_at(problem, at_keyframes), minimiser, options);
}

Found minimum_from(const SmoothingProblem& problem, const Trajectory& at_keyframes, Minimiser& minimiser,
                   const MinimiseOptions& options) {
  Found found{minimum_near(problem, at_keyframes, minimiser, options), 1};
  if (is_explained_by_noise(problem, found.minimum)) return found;
  ++found.starts;
  Minimum other = minimum_near(problem, grown_from_odometry(eased(problem)), minimiser, options);
  if (other.cost < found.minimum.cost) found.minimum = std::move(other);
  return found;
}

}  // namespace trundle::slam
