#pragma once

#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {

/// What landmarks without names are taken for has many minima, and a filter finds one of them. So the
/// smoother also starts from other runs of `fastslam2`, as `filter` but for the seed, and keeps the most
/// probable explanation of all sightings: the least χ² and cost_of_explaining. Landmarks keep the numbers
/// that `filtered` has given them. Where all sightings have names, or `runs` is 1, this is smooth().
/// docs/theory/re-association.md. Throws as smooth.
[[nodiscard]] SmoothedSlam smooth_from_many(const SlamInput& input, const LandmarkSensor& sensor,
                                            const SlamResult& filtered, const SlamOptions& filter,
                                            std::size_t runs, const SmootherOptions& options = {});

}  // namespace trundle::slam
