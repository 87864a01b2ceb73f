#include "trundle/slam/smoothing/together/robots_problem.hpp"

#include <algorithm>

#include "trundle/geometry/decompositions.hpp"

namespace trundle::slam {
namespace {

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

/// What each robot's metre is off by, as a share, by unknowns of unit variance. What all are off by in common
/// nobody sees, and counts as nothing: together as alone, a world is right in proportion to what sensors say.
/// They are the last of the parameters. docs/theory/together.md, eq. 27a.
Eigen::MatrixXd metres_of(std::span<const RobotRecording> robots, Eigen::Index parameters) {
  Eigen::VectorXd sigma(static_cast<Eigen::Index>(robots.size()));
  std::ranges::transform(robots, sigma.begin(), &RobotRecording::metre_sigma);
  const bool some_are_exact = (sigma.array() == 0.0).any();
  const Eigen::VectorXd in_common = some_are_exact ? Eigen::VectorXd((sigma.array() == 0.0).cast<double>())
                                                   : Eigen::VectorXd(sigma.cwiseInverse());
  Eigen::MatrixXd metres = Eigen::MatrixXd::Zero(sigma.size(), parameters);
  metres.rightCols(sigma.size() - 1) = sigma.asDiagonal() * orthogonal_complement(in_common);
  return metres;
}

/// Wheels that landmarks calibrated say ways in the metre of ranges: what is read as too long was shorter.
void add_metre(const Eigen::RowVectorXd& metre, TrackInput& track) {
  for (FreeMotion& motion : track.motions) {
    const Vector2 ahead = rotation(-motion.mean.heading) * motion.mean.translation();
    motion.by_parameters.topRows<2>() -= ahead * metre;
  }
}

/// And so are ranges.
SensorErrorsBy ranges_by(const Eigen::RowVectorXd& metre) {
  SensorErrorsBy errors = SensorErrorsBy::Zero(6, metre.size());
  errors.row(1) = metre;
  return errors;
}

SmoothingProblem empty_problem_of(std::span<const RobotRecording> robots,
                                  const std::vector<CountedErrors>& errors, const SmootherOptions& options) {
  const Eigen::Index count = errors.back().first_column + errors.back().columns() +
                             static_cast<Eigen::Index>(robots.size()) - 1;  // these are of metres
  SmoothingProblem problem{.sensors = {},
                           .motions = {},
                           .sightings = {},
                           .parameter_information = Eigen::VectorXd::Ones(count),
                           .parameter_mean = Eigen::VectorXd::Zero(count),
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

}  // namespace

RobotsProblem problem_of(std::span<const RobotRecording> robots, std::span<const RobotSighting> seen,
                         std::span<const ShownObservations> shown, std::vector<PlacedPath> placed,
                         const SmootherOptions& options) {
  std::vector<CountedErrors> errors = errors_of(robots);
  RobotsProblem all{.problem = empty_problem_of(robots, errors, options)};
  all.errors = std::move(errors);
  all.placed = std::move(placed);
  all.metres = metres_of(robots, all.problem.parameter_information.size());
  LandmarkNumbers numbers;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    SlamPrior prior = robots[i].prior;
    if (i > 0) prior.start = all.placed[i].start;
    if (i > 0) prior.start_covariance = free_start_covariance();
    TrackInput input = track_input(robots[i].input, shown[i], prior, all.errors[i],
                                   all.problem.parameter_information.size());
    input.also_keyframes = meetings_of(i, seen);
    input.sensor = static_cast<int>(i);
    if (!all.metres.isZero(0.0)) {
      const Eigen::RowVectorXd metre = all.metres.row(static_cast<Eigen::Index>(i));
      add_metre(metre, input);
      all.problem.sensor_errors.push_back(ranges_by(metre));
    }
    const Track& track = all.tracks.emplace_back(input, all.problem, numbers);
    all.landmarks.insert(all.landmarks.end(), track.landmarks().begin(), track.landmarks().end());
  }
  for (const RobotSighting& sighting : seen)
    all.problem.robots_seen.push_back(link_of(sighting, robots,
                                              all.tracks[sighting.seer].pose_at(sighting.seer_step),
                                              all.tracks[sighting.seen].pose_at(sighting.seen_step)));
  return all;
}

Trajectory RobotsProblem::at_keyframes(const std::vector<PlacedPath>& paths) const {
  Trajectory all;
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const Trajectory keyframes = tracks[i].at_keyframes(paths[i].path);
    all.poses.insert(all.poses.end(), keyframes.poses.begin(), keyframes.poses.end());
  }
  return all;
}

}  // namespace trundle::slam
