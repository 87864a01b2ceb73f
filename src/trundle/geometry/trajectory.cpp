#include "trundle/geometry/trajectory.hpp"

#include <algorithm>

namespace trundle::geometry {

std::optional<Pose2> pose_at(const Trajectory& trajectory, double time_s, double longest_gap_s) {
  const auto& poses = trajectory.poses;
  const auto after = std::lower_bound(poses.begin(), poses.end(), time_s,
                                      [](const StampedPose& p, double t) { return p.time_s < t; });
  if (after == poses.end()) return std::nullopt;
  if (after->time_s == time_s) return after->pose;
  if (after == poses.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double gap = after->time_s - before->time_s;
  if (gap > longest_gap_s) return std::nullopt;
  const double u = (time_s - before->time_s) / gap;
  const Twist2 step = log(before->pose.inverse() * after->pose);
  return before->pose * exp({u * step.dx, u * step.dy, u * step.dtheta});
}

std::vector<double> path_lengths(const Trajectory& trajectory) {
  std::vector<double> lengths(trajectory.poses.size());
  for (std::size_t i = 1; i < lengths.size(); ++i) {
    const Pose2& a = trajectory.poses[i - 1].pose;
    const Pose2& b = trajectory.poses[i].pose;
    lengths[i] = lengths[i - 1] + std::hypot(b.x - a.x, b.y - a.y);
  }
  return lengths;
}

Trajectory thinned(const Trajectory& trajectory, std::size_t most) {
  Trajectory result;
  const std::size_t step = trajectory.poses.size() / most + 1;
  for (std::size_t i = 0; i < trajectory.poses.size(); i += step) result.poses.push_back(trajectory.poses[i]);
  return result;
}

}  // namespace trundle::geometry
