#include "trundle/slam/smoothing/together/robots_minimum.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "trundle/geometry/decompositions.hpp"
#include "trundle/io/error.hpp"
#include "trundle/slam/nth.hpp"
#include "trundle/slam/smoothing/smoother_start.hpp"
#include "trundle/statistics/distribution.hpp"

namespace trundle::slam {
namespace {

// Beyond it a heading is not known: all headings alike have a σ of π/√3.
constexpr double kUnknownHeading_rad = 1.0;
// Starts of a robot that could lie otherwise: a descent finds its way from an eighth of a turn and more.
constexpr int kTurns = 8;
// Of two minima one is wrong with more than one in a thousand where their costs, χ², differ by less.
const double kAmbiguousCost = 2.0 * std::log(1e3);

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
void require_known_headings(std::span<const RobotRecording> robots, const RobotsProblem& all,
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

}  // namespace

std::vector<RobotsMinimum> minima_of(std::span<const RobotRecording> robots,
                                     std::span<const RobotSighting> seen, const RobotsProblem& all,
                                     Minimiser& minimiser, const SmootherOptions& options) {
  const auto from = [&](const std::vector<PlacedPath>& placed) {
    return minimum_near(all.problem, all.at_keyframes(placed), minimiser, minimise_options(options));
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

void require_known_frames(std::span<const RobotRecording> robots, const RobotsProblem& all,
                          const std::vector<RobotsMinimum>& minima, Minimiser& minimiser) {
  if (!minimiser.linearise(all.problem, minima.front().minimum.state)) throw_undetermined(robots, all);
  require_known_headings(robots, all, minimiser);
  require_one_minimum(robots, all, minima, minimiser);
}

}  // namespace trundle::slam
