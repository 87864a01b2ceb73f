#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "trundle/slam/fastslam/lost_covariance.hpp"

namespace trundle::slam {

/// The part of the map that was in view at a keyframe, by what was known then.
struct Submap {
  FrameCovariance frame;       ///< V of eq. 61
  FrameCovariance drift;       ///< what the odometry may have erred by since the start
  std::uint64_t keyframe = 0;  ///< number of the step with sightings

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.frame, self.drift, self.keyframe);
  }
};

/// The correction of the map when a loop is closed: the present submap, and the robot in it, moves to where
/// an old one says, and whatever was seen in between follows by its share of the drift.
/// docs/theory/loop-closing.md, eq. 65 to 67.
class LoopCorrection {
 public:
  /// How the present submap moves: exp of a twist in world axes about a centre, and its covariance.
  struct Move {
    Vector2 centre = Vector2::Zero();
    Vector3 twist = Vector3::Zero();       ///< (x, y, turn) [m, m, rad]
    Matrix3 covariance = Matrix3::Zero();  ///< of what is wrong with it
  };
  /// Nothing where no drift has come about since the old submap, along some direction.
  static std::optional<LoopCorrection> between(const Submap& old, const Submap& now, const Move& move);

  [[nodiscard]] const Move& move() const { return move_; }
  /// The twist about the centre by which a submap with this drift follows, as a share of that of the present
  /// one: 1 for that itself, 0 for the old one and whatever is older.
  [[nodiscard]] Matrix3 share(const FrameCovariance& drift) const;
  /// That motion, of the world.
  [[nodiscard]] Pose2 motion(const Vector3& twist) const;
  /// The twist of a motion of the world.
  [[nodiscard]] Vector3 twist(const Pose2& motion) const;
  /// The covariance of the frame of a submap with this drift, after the correction. Eq. 67.
  [[nodiscard]] FrameCovariance frame_after(const FrameCovariance& drift) const;
  /// Of the old submap.
  [[nodiscard]] const FrameCovariance& old_frame() const { return old_.frame; }

 private:
  /// Of the drift by axes, where L Lᵀ is 1.
  struct Shares {
    Matrix3 axes;
    Vector3 share;  ///< from 0 to 1
  };
  [[nodiscard]] Shares shares(const FrameCovariance& drift) const;
  /// L with each axis times a factor.
  [[nodiscard]] Matrix3 root_along(const Matrix3& axes, const Vector3& factors) const;

  Move move_;
  Submap old_;
  Matrix3 root_ = Matrix3::Zero();      ///< L Lᵀ: what the odometry may have erred by since
  Matrix3 whitener_ = Matrix3::Zero();  ///< L⁻¹
  Matrix3 growth_ = Matrix3::Zero();    ///< W: of V since, where L Lᵀ is 1
};

/// The twists of all particles' present submaps, and the mean of those that descend from one.
class Twists {
 public:
  explicit Twists(std::span<const Vector3> of_particles);
  /// Of particles from `first` to before `last`.
  [[nodiscard]] Vector3 mean(std::size_t first, std::size_t last) const;
  /// `visit(ancestor, twist)` for everyone of a held epoch who has descendants.
  template <class Visit>
  void for_ancestors(const Ancestry& ancestry, Ancestry::Epoch epoch, const Visit& visit) const {
    const std::size_t particles = sums_.size() - 1;
    if (epoch == ancestry.now()) {
      for (std::size_t i = 0; i < particles; ++i) visit(i, mean(i, i + 1));
      return;
    }
    const auto runs = ancestry.runs(epoch);
    for (std::size_t k = 0; k < runs.size(); ++k)
      visit(runs[k].ancestor, mean(runs[k].first, k + 1 < runs.size() ? runs[k + 1].first : particles));
  }

 private:
  std::vector<Vector3> sums_;  ///< over those before
};

}  // namespace trundle::slam
