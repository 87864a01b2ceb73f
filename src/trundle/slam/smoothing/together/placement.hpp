#pragma once

#include <optional>
#include <span>
#include <vector>

#include "trundle/slam/smoothing/together.hpp"

namespace trundle::slam {

/// Of one robot, in the frame that all share: where it starts, and after each of its steps.
struct PlacedPath {
  Pose2 start;
  Trajectory path;
  std::size_t shared = 0;  ///< places that tell how its frame lies in the others'
};

/// So many shared places contradict a wrong frame: two fit any for which they are as far apart in one frame
/// as in the other.
inline constexpr std::size_t kContradicting = 3;

/// A robot that is laid elsewhere: turned about the middle of what it shares with those before it.
struct Turned {
  std::size_t robot = 0;
  double by_rad = 0.0;
};

/// Steps of a robot at which it sees another, or is seen.
[[nodiscard]] std::vector<std::size_t> meetings_of(std::size_t robot, std::span<const RobotSighting> seen);
/// A sighting as a term between the poses of the two.
[[nodiscard]] RobotLink link_of(const RobotSighting& sighting, std::span<const RobotRecording> robots,
                                int pose_of_seer, int pose_of_seen);

/// A path after each step of a robot, with where it began.
[[nodiscard]] PlacedPath path_from_start(const RobotRecording& robot, Trajectory path);

/// A start for the minimisation: from robot to robot, each is laid where what it shares with those before it
/// fits (robust_rigid_motion); one that saw no landmark follows the sightings of robots along their paths.
/// Those after one that is turned are laid by what they share with it, too. docs/theory/together.md. Throws
/// CannotAnswer where a robot shares nothing with the others.
[[nodiscard]] std::vector<PlacedPath> placed_paths(std::span<const RobotRecording> robots,
                                                   std::span<const RobotSighting> seen,
                                                   const SmootherOptions& options,
                                                   const std::optional<Turned>& turned = {});

}  // namespace trundle::slam
