#pragma once

#include <cstddef>
#include <vector>

#include "trundle/geometry/trajectory.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

class IncrementalSmoother;

/// What was known at some moment of a run: of the past, too, as it was known then.
struct Snapshot {
  double time_s = 0.0;
  Pose2 pose;
  Matrix3 covariance = Matrix3::Zero();
  std::vector<StampedPose> path;    ///< up to the last keyframe
  std::vector<MappedLandmark> map;  ///< confirmed landmarks

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.time_s, self.pose, self.covariance, self.path, self.map);
  }
};

/// How the estimate of the smoother that goes along grows over a run of any length: so many moments of it at
/// most, after every step at first, then after every second, every fourth, ... one. Memory is bounded, and so
/// is the time, where the map is: of large maps so many landmarks.
class Growth {
 public:
  /// All together 128 · (200 poses of 32 bytes and 300 landmarks of 64) = 3 MB.
  static constexpr std::size_t kMostSnapshots = 128;
  static constexpr std::size_t kMostPathPoints = 200;
  static constexpr std::size_t kMostLandmarks = 300;

  /// After each step.
  void add(const IncrementalSmoother& smoother, double time_s);
  /// All of them, and the last one of now.
  [[nodiscard]] std::vector<Snapshot> with_last(const IncrementalSmoother& smoother, double time_s) const;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.stride_, self.steps_, self.snapshots_);
  }

 private:
  [[nodiscard]] Snapshot snapshot_of(const IncrementalSmoother& smoother, double time_s) const;
  [[nodiscard]] std::vector<StampedPose> path_of(const IncrementalSmoother& smoother) const;

  std::size_t stride_ = 1;
  std::size_t steps_ = 0;
  std::vector<Snapshot> snapshots_;
};

}  // namespace trundle::slam
