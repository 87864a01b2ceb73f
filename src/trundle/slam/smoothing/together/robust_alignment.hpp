#pragma once

#include <optional>
#include <span>

#include "trundle/geometry/rigid_motion.hpp"

namespace trundle::slam {

/// The rigid motion whose median residual is least, as long as more than half of the pairs are right [least
/// median of squares: Rousseeuw 1984]: each of two pairs is a candidate, of many pairs those of an evenly
/// spread choice; then the least-squares motion of the half that fits best. Nothing where no two pairs
/// determine a rotation. It is known which point is which; where that is sought, too:
/// merging/shared_frame.hpp.
[[nodiscard]] std::optional<Pose2> robust_rigid_motion(std::span<const PointPair> pairs);

}  // namespace trundle::slam
