#pragma once

#include <string>

#include "trundle/geometry/pose2.hpp"

#include "names.hpp"

namespace trundle::app {

/// The value of --start: "X,Y,DEG" [m, m, degrees]. Throws CLI::ValidationError on anything else.
Pose2 start_pose_from(const std::string& text);

}  // namespace trundle::app
