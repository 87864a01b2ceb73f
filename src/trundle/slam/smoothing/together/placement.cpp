#include "trundle/slam/smoothing/together/placement.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <map>
#include <set>

#include <fmt/format.h>

#include "trundle/io/error.hpp"
#include "trundle/slam/smoothing/counted_errors.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/slam/smoothing/solver/minimise.hpp"
#include "trundle/slam/smoothing/together/robust_alignment.hpp"

namespace trundle::slam {
namespace {

// A robot that is led along starts with a heading good to 0.2 rad, where two places are so many sigmas of a
// range apart: an error that least squares corrects at once.
constexpr double kApartInSigmas = 10.0;

using Places = std::map<LandmarkId, Vector2>;

/// Where a robot's sightings put each landmark: the median, in the frame of its path.
Places landmarks_of(const RobotRecording& robot, const Trajectory& path) {
  std::map<LandmarkId, MedianPlace> seen;
  for (std::size_t k = 0; k < robot.shown.size(); ++k)
    for (const Observation& observation : robot.shown[k])
      if (observation.landmark >= 0 && is_valid(observation))
        seen[observation.landmark].add(
            sighted_landmark(path.poses[k].pose, robot.sensor.body_from_sensor, observation).in_world);
  Places places;
  for (auto& [landmark, places_seen] : seen) places[landmark] = places_seen.take();
  return places;
}

/// In the frame that all share.
Vector2 middle_of(const std::vector<PointPair>& pairs) {
  Vector2 sum = Vector2::Zero();
  for (const PointPair& pair : pairs) sum += pair.to;
  return sum / static_cast<double>(pairs.size());
}

/// Where a path after each step of a robot began.
Pose2 start_of(const RobotRecording& robot, const Trajectory& path) {
  return path.poses.front().pose * robot.input.steps.front().motion.mean.inverse();
}

/// Places robots one after the other.
class FramePlacement {
 public:
  FramePlacement(std::span<const RobotRecording> robots, std::span<const RobotSighting> seen,
                 const SmootherOptions& options, const std::optional<Turned>& turned)
      : robots_(robots), seen_(seen), options_(options), turned_(turned), placed_(robots.size()) {
    for (const RobotRecording& robot : robots) own_.push_back(landmarks_of(robot, robot.path));
  }

  std::vector<PlacedPath> run() {
    place(first(), {}, kContradicting);
    for (std::size_t i = 1; i < robots_.size(); ++i) place_next();
    return in_first_frame();
  }

 private:
  /// The first that saw a landmark: its path is better than odometry.
  std::size_t first() const {
    const auto found = std::ranges::find_if(own_, [](const Places& places) { return !places.empty(); });
    return found == own_.end() ? 0 : static_cast<std::size_t>(found - own_.begin());
  }

  void place(std::size_t robot, const Pose2& world_from_own, std::size_t shared) {
    PlacedPath placed{world_from_own * start_of(robots_[robot], robots_[robot].path), robots_[robot].path,
                      shared};
    for (StampedPose& pose : placed.path.poses) pose.pose = world_from_own * pose.pose;
    add(robot, std::move(placed));
  }

  void add(std::size_t robot, PlacedPath placed) {
    for (const auto& [landmark, place] : landmarks_of(robots_[robot], placed.path))
      map_.try_emplace(landmark, place);
    placed_[robot] = std::move(placed);
  }

  bool links_to_placed(const RobotSighting& sighting, std::size_t robot) const {
    return (sighting.seer == robot && placed_[sighting.seen]) ||
           (sighting.seen == robot && placed_[sighting.seer]);
  }

  /// Landmarks that it shares with those that are placed.
  std::vector<PointPair> landmark_pairs(std::size_t robot) const {
    std::vector<PointPair> pairs;
    for (const auto& [landmark, place] : own_[robot])
      if (const auto there = map_.find(landmark); there != map_.end())
        pairs.push_back({place, there->second});
    return pairs;
  }

  /// One of the two is placed, and the point is where it sees the other, or is seen by it.
  PointPair pair_of(const RobotSighting& sighting, std::size_t robot) const {
    const RobotRecording& seer = robots_[sighting.seer];
    const auto pose = [&](std::size_t of, std::size_t step) {
      return (of == robot ? robots_[of].path : placed_[of]->path).poses[step].pose;
    };
    const Vector2 by_seer = sighted_landmark(pose(sighting.seer, sighting.seer_step),
                                             seer.sensor.body_from_sensor, sighting.observation)
                                .in_world;
    const Vector2 by_seen = pose(sighting.seen, sighting.seen_step) * robots_[sighting.seen].marker_on_body;
    return sighting.seer == robot ? PointPair{by_seer, by_seen} : PointPair{by_seen, by_seer};
  }

  std::vector<PointPair> robot_pairs(std::size_t robot) const {
    std::vector<PointPair> pairs;
    for (const RobotSighting& sighting : seen_)
      if (links_to_placed(sighting, robot)) pairs.push_back(pair_of(sighting, robot));
    return pairs;
  }

  /// Those to be placed that share something with placed ones: first whoever shares the most landmarks, then
  /// the most sightings of robots.
  std::vector<std::size_t> nearest_first() const {
    using Shared = std::pair<std::size_t, std::size_t>;
    std::vector<std::pair<Shared, std::size_t>> candidates;
    for (std::size_t i = 0; i < robots_.size(); ++i)
      if (const Shared shared(landmark_pairs(i).size(), robot_pairs(i).size());
          !placed_[i] && shared > Shared{})
        candidates.emplace_back(shared, i);
    std::ranges::stable_sort(candidates, std::greater{},
                             [](const auto& candidate) { return candidate.first; });
    std::vector<std::size_t> robots;
    for (const auto& [shared, robot] : candidates) robots.push_back(robot);
    return robots;
  }

  /// The nearest whose frame is determined by what it shares: those placed so may determine that of others.
  void place_next() {
    const std::vector<std::size_t> candidates = nearest_first();
    for (const std::size_t robot : candidates)
      if (is_placed_by_what_it_shares(robot)) return;
    if (!candidates.empty()) throw_undetermined(candidates.front());
    const auto left = std::ranges::find_if(placed_, std::logical_not{}) - placed_.begin();
    throw CannotAnswer(fmt::format("{}: no overlap: it shares no landmark and no sighting of a robot with {}",
                                   robots_[static_cast<std::size_t>(left)].name, names_of_placed()));
  }

  bool is_placed_by_what_it_shares(std::size_t robot) {
    if (own_[robot].empty()) return is_placed_along_meetings(robot);
    const std::vector<PointPair> pairs = what_frames_follow_from(robot);
    const std::optional<Pose2> frame = frame_by(pairs, robot);
    if (frame) place(robot, *frame, pairs.size());
    return frame.has_value();
  }

  std::string names_of_placed() const {
    std::string names;
    for (std::size_t i = 0; i < robots_.size(); ++i)
      if (placed_[i]) names += (names.empty() ? "" : ", ") + robots_[i].name;
    return names;
  }

  [[noreturn]] void throw_undetermined(std::size_t robot) const {
    throw CannotAnswer(fmt::format(
        "{}: what it shares with {} lies in one place: that does not fix the rotation between their frames",
        robots_[robot].name, names_of_placed()));
  }

  /// Landmarks alone where there are enough: that many sightings of robots would outvote them.
  std::vector<PointPair> what_frames_follow_from(std::size_t robot) const {
    std::vector<PointPair> pairs = landmark_pairs(robot);
    if (pairs.size() >= kContradicting) return pairs;
    const std::vector<PointPair> more = robot_pairs(robot);
    pairs.insert(pairs.end(), more.begin(), more.end());
    return pairs;
  }

  /// Nothing: they lie in one place.
  std::optional<Pose2> frame_by(const std::vector<PointPair>& pairs, std::size_t robot) const {
    const std::optional<Pose2> frame = robust_rigid_motion(pairs);
    if (!frame || !turned_ || robot != turned_->robot) return frame;
    const Vector2 middle = middle_of(pairs);
    return Pose2{middle.x(), middle.y(), turned_->by_rad} * Pose2{-middle.x(), -middle.y(), 0.0} * *frame;
  }

  /// From the first sightings that link it with placed ones, until their places are far enough apart.
  std::optional<Pose2> frame_at_first(std::size_t robot) const {
    std::vector<PointPair> pairs;
    double sigma_m = 0.0, apart_m = 0.0;
    for (const RobotSighting& sighting : seen_) {
      if (!links_to_placed(sighting, robot)) continue;
      pairs.push_back(pair_of(sighting, robot));
      sigma_m = std::max(sigma_m, robots_[sighting.seer].sensor.range_sigma_m);
      apart_m = std::max(apart_m, (pairs.back().from - pairs.front().from).norm());
      if (apart_m > kApartInSigmas * sigma_m) break;
    }
    return frame_by(pairs, robot);
  }

  struct KnownPoses {
    SmoothingProblem problem;
    SmoothingState state;
  };
  bool is_placed_along_meetings(std::size_t robot);
  KnownPoses known_poses(std::size_t robot, std::span<const RobotSighting> linking,
                         const CountedErrors& errors) const;
  void add_links(std::size_t robot, std::span<const RobotSighting> linking, const Track& track,
                 SmoothingProblem& problem) const;

  std::vector<PlacedPath> in_first_frame() const {
    const Pose2 first_from_world = robots_.front().prior.start * placed_.front()->start.inverse();
    std::vector<PlacedPath> all;
    for (const std::optional<PlacedPath>& placed : placed_) {
      all.push_back(*placed);
      all.back().start = first_from_world * all.back().start;
      for (StampedPose& pose : all.back().path.poses) pose.pose = first_from_world * pose.pose;
    }
    return all;
  }

  std::span<const RobotRecording> robots_;
  std::span<const RobotSighting> seen_;
  SmootherOptions options_;
  std::optional<Turned> turned_;
  std::vector<Places> own_;                        ///< by robot, in its own frame
  Places map_;                                     ///< of those that are placed
  std::vector<std::optional<PlacedPath>> placed_;  ///< by robot; nothing: not yet
};

// The poses of placed robots at its sightings are known; its chain grows along them. False: they do not fix
// it.
bool FramePlacement::is_placed_along_meetings(std::size_t robot) {
  const RobotRecording& recording = robots_[robot];
  const std::optional<Pose2> frame = frame_at_first(robot);
  if (!frame) return false;
  SlamPrior prior = recording.prior;
  prior.start = *frame * start_of(recording, recording.path);
  prior.start_covariance = free_start_covariance();
  const CountedErrors errors = counted_errors(recording.input, prior, recording.systematic);
  std::vector<RobotSighting> linking;  // the n-th, from the n-th pose of the problem or to it
  std::ranges::copy_if(seen_, std::back_inserter(linking),
                       [&](const RobotSighting& sighting) { return links_to_placed(sighting, robot); });
  auto [problem, state] = known_poses(robot, linking, errors);
  TrackInput input = track_input(recording.input, recording.shown, prior, errors);
  input.also_keyframes = meetings_of(robot, linking);
  LandmarkNumbers numbers;
  const Track track(input, problem, numbers);
  add_links(robot, linking, track, problem);
  Minimiser minimiser(problem);
  const Minimum minimum =
      minimum_near(problem, grown_from(problem, std::move(state)), minimiser, minimise_options(options_));
  if (!minimiser.linearise(problem, minimum.state)) return false;
  Trajectory path = track.trajectory(minimum.state, minimiser);
  PlacedPath placed = path_from_start(recording, std::move(path));
  placed.shared = linking.size();
  add(robot, std::move(placed));
  return true;
}

/// A problem of the placed robots' poses at these sightings alone, one for each.
FramePlacement::KnownPoses FramePlacement::known_poses(std::size_t robot,
                                                       std::span<const RobotSighting> linking,
                                                       const CountedErrors& errors) const {
  KnownPoses known{{.sensors = {},
                    .motions = {},
                    .sightings = {},
                    .parameter_information = errors.information(),
                    .parameter_mean = errors.mean(),
                    .has_bias = errors.has_bias,
                    .gate = options_.gate},
                   {}};
  auto& [problem, state] = known;
  for (const RobotRecording& each : robots_) problem.sensors.push_back(each.sensor);
  state.parameters = Eigen::VectorXd::Zero(problem.parameter_information.size());
  const FreeMotion none{{}, Matrix3::Zero(), Eigen::Matrix3Xd::Zero(3, state.parameters.size())};
  for (const RobotSighting& sighting : linking) {
    const Pose2 pose = sighting.seer == robot ? placed_[sighting.seen]->path.poses[sighting.seen_step].pose
                                              : placed_[sighting.seer]->path.poses[sighting.seer_step].pose;
    problem.motions.push_back(link_from({.pose = pose}, problem.poses++, none));
    state.poses.push_back(pose);
    if (problem.has_bias) state.biases.push_back(0.0);
  }
  return known;
}

/// Between the robot's track and the known poses.
void FramePlacement::add_links(std::size_t robot, std::span<const RobotSighting> linking, const Track& track,
                               SmoothingProblem& problem) const {
  for (std::size_t n = 0; n < linking.size(); ++n) {
    const RobotSighting& sighting = linking[n];
    const int known = static_cast<int>(n);
    problem.robots_seen.push_back(sighting.seer == robot
                                      ? link_of(sighting, robots_, track.pose_at(sighting.seer_step), known)
                                      : link_of(sighting, robots_, known, track.pose_at(sighting.seen_step)));
  }
}

}  // namespace

std::vector<std::size_t> meetings_of(std::size_t robot, std::span<const RobotSighting> seen) {
  std::set<std::size_t> steps;
  for (const RobotSighting& sighting : seen) {
    if (sighting.seer == robot) steps.insert(sighting.seer_step);
    if (sighting.seen == robot) steps.insert(sighting.seen_step);
  }
  return {steps.begin(), steps.end()};
}

RobotLink link_of(const RobotSighting& sighting, std::span<const RobotRecording> robots, int pose_of_seer,
                  int pose_of_seen) {
  return {.pose = pose_of_seer,
          .seen = pose_of_seen,
          .observation = sighting.observation,
          .sensor = static_cast<int>(sighting.seer),
          .marker_on_seen = robots[sighting.seen].marker_on_body,
          .marker_sigma_m = robots[sighting.seen].marker_sigma_m};
}

PlacedPath path_from_start(const RobotRecording& robot, Trajectory path) {
  const Pose2 start = start_of(robot, path);
  return {start, std::move(path)};
}

std::vector<PlacedPath> placed_paths(std::span<const RobotRecording> robots,
                                     std::span<const RobotSighting> seen, const SmootherOptions& options,
                                     const std::optional<Turned>& turned) {
  return FramePlacement(robots, seen, options, turned).run();
}

}  // namespace trundle::slam
