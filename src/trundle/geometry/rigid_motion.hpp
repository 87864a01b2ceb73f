#pragma once

#include <optional>
#include <span>

#include "trundle/geometry/pose2.hpp"

namespace trundle::geometry {

/// A place, and where it is taken to.
struct PointPair {
  Vector2 from;
  Vector2 to;
};

/// The rigid motion T that minimises Σ |to − T from|², in closed form [Umeyama 1991, in the plane]: about the
/// centroids, by the angle of the summed products. Nothing where the points do not show a rotation (all in
/// one place, or there are none).
std::optional<Pose2> rigid_motion(std::span<const PointPair> pairs);

}  // namespace trundle::geometry
