#include "trundle/recording/increments.hpp"

#include <cmath>

namespace trundle {

Trajectory reference_trajectory(const Recording& recording) {
  const ReferenceStream& reference = recording.reference;
  Trajectory trajectory;
  for (std::size_t row = 0; row < reference.time_s.size(); ++row) {
    const Pose2 pose{reference.x_m[row], reference.y_m[row], reference.heading_rad[row]};
    if (std::isfinite(pose.x) && std::isfinite(pose.y) && std::isfinite(pose.heading))
      trajectory.poses.push_back({reference.time_s[row], pose});
  }
  return trajectory;
}

}  // namespace trundle
