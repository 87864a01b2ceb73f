#pragma once

#include <string>

#include "names.hpp"
#include "trundle/geometry/pose2.hpp"

namespace trundle::app {

/// The value of --start: "X,Y,DEG" [m, m, degrees]. Throws CLI::ValidationError on anything else.
Pose2 start_pose_from(const std::string& text);

}  // namespace trundle::app
