#pragma once

#include "trundle/slam/slam.hpp"

namespace trundle::slam {

/// The observations of each step, each with the landmark that it shows.
using ShownObservations = std::vector<std::vector<Observation>>;

/// What each says itself, else what the filter matched it to and its map still has; kUnknownLandmark where it
/// is neither.
[[nodiscard]] ShownObservations shown_observations(const SlamInput& input, const SlamResult& filtered);

/// What has no name, from `named` on, is a landmark of this robot alone: it is numbered from `next` on, which
/// counts them.
void number_unidentified(LandmarkId named, LandmarkId& next, ShownObservations& shown);

}  // namespace trundle::slam
