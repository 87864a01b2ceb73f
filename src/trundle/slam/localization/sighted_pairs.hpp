#pragma once

#include <vector>

#include "trundle/slam/localization/local_map.hpp"
#include "trundle/slam/localization/map_sight.hpp"

namespace trundle::slam {

/// Two points of a local map: with each two landmarks of the map as far apart they make a hypothesis.
struct SightedPair {
  std::size_t first = 0;  ///< number of the point
  std::size_t second = 0;
  double baseline_m = 0.0;
  double first_variance = 0.0;  ///< of each point's place along the baseline [m²]
  double second_variance = 0.0;
  double low_m = 0.0;  ///< how far apart the landmarks are that it may show
  double high_m = 0.0;

  [[nodiscard]] double variance() const { return first_variance + second_variance; }
};

/// A name that the map has, or none.
[[nodiscard]] inline bool is_usable(const SightedPoint& point, const KnownMap& map) {
  return point.landmark == kUnknownLandmark || map.has(point.landmark);
}

/// Pairs of points, one of them seen just now, those first that leave least to try: the fewest pairs of
/// landmarks at that distance, times the area in which the other points would then be looked for. At most
/// `most_pairs`; while there are others no point is in two, so that one outlier spoils one pair.
/// docs/theory/global-localization.md, eq. 47a.
[[nodiscard]] std::vector<SightedPair> rarest_pairs(const LocalMap& seen, const KnownMap& map,
                                                    const MapSightOptions& options);

}  // namespace trundle::slam
