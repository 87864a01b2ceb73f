#include "trundle/slam/smoothing/incremental/growth.hpp"

#include <algorithm>

#include "trundle/slam/smoothing/incremental_smoother.hpp"

namespace trundle::slam {
namespace {

/// Evenly in time: those that were taken earlier, further apart, stay.
std::vector<StampedPose> thinned(const std::vector<StampedPose>& path, std::size_t most) {
  if (path.size() <= most) return path;
  const double step_s = (path.back().time_s - path.front().time_s) / static_cast<double>(most - 2);
  std::vector<StampedPose> kept;
  for (const StampedPose& pose : path)
    if (kept.empty() || pose.time_s >= kept.back().time_s + step_s) kept.push_back(pose);
  if (kept.back().time_s < path.back().time_s) kept.push_back(path.back());
  return kept;
}

}  // namespace

void Growth::add(const IncrementalSmoother& smoother, double time_s) {
  if (steps_++ % stride_ != 0) return;
  snapshots_.push_back(snapshot_of(smoother, time_s));
  if (snapshots_.size() < kMostSnapshots) return;
  std::size_t kept = 1;
  for (; 2 * kept < snapshots_.size(); ++kept) snapshots_[kept] = std::move(snapshots_[2 * kept]);
  snapshots_.resize(kept);
  stride_ *= 2;
}

std::vector<Snapshot> Growth::with_last(const IncrementalSmoother& smoother, double time_s) const {
  std::vector<Snapshot> all = snapshots_;
  if (all.empty() || all.back().time_s < time_s) all.push_back(snapshot_of(smoother, time_s));
  return all;
}

Snapshot Growth::snapshot_of(const IncrementalSmoother& smoother, double time_s) const {
  const PoseEstimate estimate = smoother.estimate();
  Snapshot snapshot{time_s, estimate.pose, estimate.covariance, path_of(smoother), {}};
  std::vector<std::size_t> confirmed;
  for (std::size_t i = 0; i < smoother.landmarks(); ++i)
    if (smoother.is_confirmed(i)) confirmed.push_back(i);
  const std::size_t shown = std::min(confirmed.size(), kMostLandmarks);
  for (std::size_t i = 0; i < shown; ++i)
    snapshot.map.push_back(smoother.landmark(confirmed[i * confirmed.size() / shown]));
  return snapshot;
}

/// What has left the window stands where it was known last.
std::vector<StampedPose> Growth::path_of(const IncrementalSmoother& smoother) const {
  const std::vector<StampedPose> window = smoother.path();
  if (window.empty() || snapshots_.empty()) return thinned(window, kMostPathPoints);
  std::vector<StampedPose> path;
  for (const StampedPose& before : snapshots_.back().path)
    if (before.time_s < window.front().time_s) path.push_back(before);
  path.insert(path.end(), window.begin(), window.end());
  return thinned(path, kMostPathPoints);
}

}  // namespace trundle::slam
