#pragma once

#include <optional>
#include <vector>

#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {

/// What a run shows to be inconsistent: a filter that diverged, sigmas that are too small, a smoother that
/// stopped early. Empty where it is consistent. `smoothed` may be null.
[[nodiscard]] std::vector<Finding> consistency_checks(const SlamInput& input, const SlamResult& filtered,
                                                      const SmoothedSlam* smoothed);

/// Of innovations alone: that sigmas are too small, by half of all NIS being above `median_nis`.
[[nodiscard]] std::vector<Finding> innovation_checks(std::optional<double> median_nis, std::size_t sightings);

/// Of a smoother's run alone: that it stopped early, or that sigmas are too small.
[[nodiscard]] std::vector<Finding> consistency_checks(const SmootherCounts& counts);

/// Errors that all ranges or bearings have in common, by a score, where they are no chance and beyond half a
/// sigma of one reading. `dispersion`: cost for each degree of freedom.
[[nodiscard]] std::vector<Finding> common_errors(const SensorScores& scores, double dispersion,
                                                 std::size_t sightings);

}  // namespace trundle::slam
