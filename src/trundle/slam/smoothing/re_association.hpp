#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "trundle/slam/slam.hpp"
#include "trundle/slam/smoothing/shown.hpp"

namespace trundle::slam {

// Which landmarks unidentified sightings show, given whole smoothed paths and their map: batch
// re-association. docs/theory/re-association.md.

/// What the sightings of one robot are said to show, and the smoothed path that it saw them from.
struct ShownFromPath {
  const ShownObservations& shown;
  const Trajectory& path;  ///< after each step
  const LandmarkSensor& sensor;
};

/// −2 log of how probable it is that sightings of robots with one map show what they are said to, beyond the
/// smoother's cost: the fewer landmarks there are, the fewer sightings show none of them, and the more
/// regularly each is seen from where a sensor sees that far, the better. Eq. 14.
[[nodiscard]] double cost_of_explaining(std::span<const ShownFromPath> robots,
                                        std::span<const MappedLandmark> map);

/// Covariance of the difference of two landmarks' positions.
using DifferenceCovariance = std::function<Matrix2(LandmarkId, LandmarkId)>;
using LandmarkPair = std::pair<LandmarkId, LandmarkId>;

/// Pairs of landmarks that are, as far as the map shows, the same one mapped twice; the clearest first, no
/// landmark in two of them, none that were seen in the same instant; the second of each has no name. Eq. 15.
/// Each pair is judged alone, for the batch takes back what does not lower the cost; online there is no way
/// back, so all are judged together there (docs/theory/online-smoother.md, eq. 25).
[[nodiscard]] std::vector<LandmarkPair> duplicates_in(std::span<const ShownObservations> shown,
                                                      std::span<const MappedLandmark> map, double max_range_m,
                                                      LandmarkId first_unidentified,
                                                      const DifferenceCovariance& covariance);
/// The second of each pair becomes the first.
[[nodiscard]] ShownObservations with_merged(ShownObservations shown, std::span<const LandmarkPair> pairs);

/// The most probable explanation of each instant from the smoothed pose of the robot, by the landmarks of the
/// map. What has a name in the robot's input keeps it. Eq. 16.
[[nodiscard]] std::vector<ShownObservations> reassociated(std::span<const SlamInput* const> inputs,
                                                          std::span<const ShownFromPath> robots,
                                                          std::span<const MappedLandmark> map);

/// Whether all sightings show the same in both.
[[nodiscard]] bool are_same_associations(const ShownObservations& a, const ShownObservations& b);

}  // namespace trundle::slam
