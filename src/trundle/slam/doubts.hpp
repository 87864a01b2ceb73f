#pragma once

#include <vector>

#include "trundle/slam/smoothing/smoother.hpp"

namespace trundle::slam {

/// Why a run should not be believed, by its own evidence; empty where nothing speaks against it. `smoothed`
/// may be null.
std::vector<Finding> doubts_about(const SlamInput& input, const SlamResult& filtered,
                                  const SmoothedSlam* smoothed);

}  // namespace trundle::slam
