#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "trundle/slam/fastslam/lost_covariance.hpp"

namespace trundle::slam {

/// When a piece of the map was in view, told by what was known then.
struct Submap {
  FrameCovariance doubt;      ///< V of eq. 61
  FrameCovariance drift;      ///< what the odometry may have erred by since the start
  std::uint64_t station = 0;  ///< number of the step with sightings

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.doubt, self.drift, self.station);
  }
};

/// A loop is closed: the map is bent so that its present piece, and the robot in it, comes to lie where a
/// piece of old says, and whatever was seen in between follows by its share of the drift.
/// docs/theory/loop-closing.md, eq. 65 to 67.
class LoopCorrection {
 public:
  /// How the present piece moves: exp of a twist in world axes about a centre, and its covariance.
  struct Move {
    Vector2 centre = Vector2::Zero();
    Vector3 twist = Vector3::Zero();       ///< (x, y, turn) [m, m, rad]
    Matrix3 covariance = Matrix3::Zero();  ///< of what is wrong with it
  };
  /// Nothing where no drift has come about since the piece of old, along some direction.
  static std::optional<LoopCorrection> between(const Submap& old, const Submap& now, const Move& move);

  [[nodiscard]] const Move& move() const { return move_; }
  /// The twist about the centre by which a piece with this drift follows, as a share of that of the present:
  /// 1 for that of the present, 0 for that of old and whatever is older.
  [[nodiscard]] Matrix3 share(const FrameCovariance& drift) const;
  /// That motion, of the world.
  [[nodiscard]] Pose2 motion(const Vector3& twist) const;
  /// The twist of a motion of the world.
  [[nodiscard]] Vector3 twist(const Pose2& motion) const;
  /// In what doubt a piece with this drift is then.
  [[nodiscard]] FrameCovariance doubt_after(const FrameCovariance& drift) const;
  /// Of the piece of old.
  [[nodiscard]] const FrameCovariance& old_doubt() const { return old_.doubt; }

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
  Matrix3 doubt_ = Matrix3::Zero();     ///< that has come about since, where L Lᵀ is 1
};

/// The twists of all particles' present pieces, and the mean of those that descend from one.
class Twists {
 public:
  explicit Twists(std::span<const Vector3> of_particles);
  /// Of particles from `first` to before `last`.
  [[nodiscard]] Vector3 mean(std::size_t first, std::size_t last) const;
  /// `visit(ancestor, twist)` for everyone of a held epoch who has descendants.
  template <class Visit>
  void for_families(const Ancestry& ancestry, Ancestry::Epoch epoch, const Visit& visit) const {
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
