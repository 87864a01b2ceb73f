#pragma once

#include "trundle/slam/slam.hpp"

namespace trundle {

/// The observations of each step, each with the landmark that it shows: what it says itself, else what the
/// filter took it for and still believes in; kUnknownLandmark where it is neither.
std::vector<std::vector<Observation>> shown_observations(const SlamInput& input, const SlamResult& filtered);

}  // namespace trundle
