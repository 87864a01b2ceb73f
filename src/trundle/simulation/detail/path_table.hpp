#pragma once

#include "trundle/simulation/detail/scenario_keys.hpp"

namespace trundle::simulation::scenario_file {

/// The steps of a run, [[run.path]], joined.
Path read_path(const Section& run, const Pace& pace, const Pose2& start, Random& random);

}  // namespace trundle::simulation::scenario_file
