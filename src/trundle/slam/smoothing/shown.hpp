#pragma once

#include "trundle/slam/slam.hpp"

namespace trundle {

/// The observations of each step, each with the landmark that it shows.
using ShownObservations = std::vector<std::vector<Observation>>;

/// What each says itself, else what the filter took it for and still believes in; kUnknownLandmark where it
/// is neither.
ShownObservations shown_observations(const SlamInput& input, const SlamResult& filtered);

}  // namespace trundle
