#pragma once

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {

// Which landmarks unidentified sightings show, given the whole smoothed path and map: batch re-association.
// docs/theory/re-association.md.

/// −2 log of how probable it is that sightings show what they are said to, beyond the smoother's cost: the
/// fewer landmarks there are, the fewer sightings show none of them, and the more regularly each is seen from
/// where the sensor sees that far, the better. Eq. 14.
[[nodiscard]] double cost_of_explaining(const ShownObservations& shown, const SmoothedSlam& smoothed,
                                        const LandmarkSensor& sensor);

/// Covariance of the difference of two landmarks' positions.
using DifferenceCovariance = std::function<Matrix2(LandmarkId, LandmarkId)>;
using LandmarkPair = std::pair<LandmarkId, LandmarkId>;

/// Pairs of landmarks that are, as far as the map shows, the same one mapped twice; the clearest first, no
/// landmark in two of them, none that were seen in the same instant; the second of each has no name. Eq. 15.
/// Each pair is judged alone, for smooth() takes back what does not lower the cost; online there is no way
/// back, so all are judged together there (docs/theory/online-smoother.md, eq. 25).
[[nodiscard]] std::vector<LandmarkPair> duplicates_in(const ShownObservations& shown,
                                                      std::span<const MappedLandmark> map,
                                                      const LandmarkSensor& sensor,
                                                      LandmarkId first_unidentified,
                                                      const DifferenceCovariance& covariance);
/// The second of each pair becomes the first.
[[nodiscard]] ShownObservations with_merged(ShownObservations shown, std::span<const LandmarkPair> pairs);

/// The most probable explanation of each instant from the smoothed pose, by the landmarks of the map. What
/// has a name keeps it. Eq. 16.
[[nodiscard]] ShownObservations reassociated(ShownObservations shown, const SlamInput& input,
                                             const SmoothedSlam& smoothed, const LandmarkSensor& sensor);

/// Whether all sightings show the same in both.
[[nodiscard]] bool are_same_associations(const ShownObservations& a, const ShownObservations& b);

}  // namespace trundle::slam
