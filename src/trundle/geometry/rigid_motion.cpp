#include "trundle/geometry/rigid_motion.hpp"

#include <cmath>

namespace trundle::geometry {

std::optional<Pose2> rigid_motion(std::span<const PointPair> pairs) {
  Vector2 from = Vector2::Zero(), to = Vector2::Zero();
  for (const PointPair& pair : pairs) {
    from += pair.from / static_cast<double>(pairs.size());
    to += pair.to / static_cast<double>(pairs.size());
  }
  double dot = 0.0, cross = 0.0;
  for (const PointPair& pair : pairs) {
    const Vector2 a = pair.from - from;
    const Vector2 b = pair.to - to;
    dot += a.dot(b);
    cross += a.x() * b.y() - a.y() * b.x();
  }
  if (std::hypot(dot, cross) == 0.0) return std::nullopt;
  const double angle = std::atan2(cross, dot);
  const Vector2 shift = to - rotation(angle) * from;
  return Pose2{shift.x(), shift.y(), angle};
}

}  // namespace trundle::geometry
