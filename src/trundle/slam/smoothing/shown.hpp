#pragma once

#include "trundle/slam/slam.hpp"

namespace trundle::slam {

/// The observations of each step, each with the landmark that it shows.
using ShownObservations = std::vector<std::vector<Observation>>;

/// What each says itself, else what the filter matched it to and its map still has; kUnknownLandmark where it
/// is neither.
[[nodiscard]] ShownObservations shown_observations(const SlamInput& input, const SlamResult& filtered);

}  // namespace trundle::slam
