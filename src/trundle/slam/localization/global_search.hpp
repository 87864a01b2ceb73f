#pragma once

#include <vector>

#include "trundle/slam/localization/local_map.hpp"
#include "trundle/slam/localization/map_sight.hpp"

namespace trundle::slam {

/// Hypotheses that are found or followed at one time: bounds the work of a step and decides nothing, for the
/// improbable ones go first.
inline constexpr std::size_t kMostHypotheses = 64;

/// A pose at which the landmarks seen lately would be landmarks of the map.
struct PoseHypothesis {
  PoseEstimate pose;
  /// Against 'nothing of this is in the map': docs/theory/global-localization.md, eq. 49.
  double log_odds = 0.0;
  std::vector<LandmarkGain> made_of = {};  ///< landmarks that the points show
  std::size_t matched = 0;                 ///< points of the local map that show a landmark of the map
};

/// What a search found.
struct FoundPoses {
  std::vector<PoseHypothesis> poses;  ///< the most probable first, no two of them the same
  /// More than kMostHypotheses places explain all that was seen: some were not tried, and one of them may be
  /// the right one.
  bool is_ambiguous = false;
};

/// The poses that explain the local map better than chance. Each comes from two points, one of them seen just
/// now, that lie as far apart as two landmarks of the map do (their names agreeing where they have any), and
/// is improved and judged by the others. docs/theory/global-localization.md, eq. 47 to 49a.
[[nodiscard]] FoundPoses find_poses(const LocalMap& seen, const KnownMap& map, const LandmarkSensor& sensor,
                                    const MapSightOptions& options);

/// What the hypothesis that the robot is at a pose, or as near as another hypothesis would count as the same,
/// has in its favour: as find_poses would say it.
[[nodiscard]] double log_odds_at(const PoseEstimate& pose, const LocalMap& seen, const KnownMap& map,
                                 const LandmarkSensor& sensor, const MapSightOptions& options);

/// Too near to each other to be two hypotheses.
[[nodiscard]] bool is_same_place(const Pose2& a, const Pose2& b, const SamePlace& same);

}  // namespace trundle::slam
