#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "trundle/geometry/pose2.hpp"

namespace trundle::geometry {

struct StampedPose {
  double time_s = 0.0;
  Pose2 pose;

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.time_s, self.pose);
  }
};

/// Poses in time order, with the covariance of (x, y, heading) in world axes where it is known.
struct Trajectory {
  std::vector<StampedPose> poses;
  std::vector<Matrix3> covariances = {};  ///< one for each pose, or none at all

  [[nodiscard]] bool has_covariance() const { return !covariances.empty(); }

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.poses, self.covariances);
  }
};

/// The pose at a time by interpolation along the twist between its neighbours; nothing where the time lies
/// outside or the neighbours are more than `longest_gap_s` apart. docs/theory/geometry.md, eq. 14.
[[nodiscard]] std::optional<Pose2> pose_at(const Trajectory& trajectory, double time_s, double longest_gap_s);

/// Metres along the poses, from the first (0) to each.
[[nodiscard]] std::vector<double> path_lengths(const Trajectory& trajectory);

/// Every n-th pose, without covariances: at most so many, for a picture.
[[nodiscard]] Trajectory thinned(const Trajectory& trajectory, std::size_t most);

}  // namespace trundle::geometry
