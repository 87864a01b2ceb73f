#pragma once

#include <optional>
#include <span>

#include "trundle/geometry/pose2.hpp"

namespace trundle {

/// A landmark where it is seen, from where the robot is taken to be, and where it is mapped.
struct SeenAndMapped {
  Vector2 seen;
  Vector2 mapped;
  Matrix2 seen_covariance;  ///< of the reading, in the world; the map is taken to be as sure as that
};

/// The motion in the world that takes what is seen, and with it the robot, to where it is mapped. Nothing
/// where there are fewer than three, or no motion does to within their errors. docs/theory/ekf.md, eq. 6a.
std::optional<Pose2> agreed_motion(std::span<const SeenAndMapped> landmarks);

}  // namespace trundle
