#pragma once

#include <deque>
#include <vector>

#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/loop_correction.hpp"
#include "trundle/slam/motion.hpp"

namespace trundle::slam {

/// The whole path of every particle that is alive. What all of them share, everything up to their last common
/// ancestor, is stored once; above it only what somebody descends from. Poses are drawn at keyframes, where
/// something was seen; steps between two keyframes are the same for all particles but for where they ended
/// up.
class ParticlePaths {
 public:
  /// A step without sightings: how the body has moved since the last keyframe.
  void propagate(const Motion& since_keyframe);
  /// A keyframe: every particle's pose, `since_keyframe` after the one before. `ancestry` is that of them
  /// all; `drift`: what the odometry may have erred by up to it.
  void add_keyframe(const Motion& since_keyframe, std::span<const Pose2> poses, Ancestry& ancestry,
                    const FrameCovariance& drift);
  /// Every keyframe by its share.
  void correct(const LoopCorrection& correction, const Twists& twists, const Ancestry& ancestry);
  /// After ancestry.resample().
  void resampled(Ancestry& ancestry);

  /// Poses of all steps, from `start`, for a particle with these systematic errors; between keyframes as is
  /// most probable given both. docs/theory/fastslam.md, eq. 18.
  struct Query {
    Ancestry::Index particle = 0;
    Pose2 start = {};
    Systematic systematic = {};
  };
  [[nodiscard]] std::vector<Pose2> path_of(const Query& query, const Ancestry& ancestry) const;
  /// How many of the particles at the keyframe so many before the last have descendants; 1: all are of one.
  [[nodiscard]] std::size_t ancestors(std::size_t keyframes_back, const Ancestry& ancestry) const;
  /// Poses stored: for tests of what it costs.
  [[nodiscard]] std::size_t stored() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.steps_, self.common_, self.segments_, self.drifts_);
  }

 private:
  /// The keyframes of one epoch.
  struct Segment {
    Ancestry::Epoch epoch = 0;
    std::vector<Ancestry::Index> particles;  ///< whose poses are kept, ascending
    std::vector<Pose2> poses;                ///< keyframe by keyframe

    [[nodiscard]] std::size_t keyframes() const { return poses.size() / particles.size(); }
    /// Of a pose.
    [[nodiscard]] std::size_t index(std::size_t keyframe, Ancestry::Index particle) const;
    [[nodiscard]] const Pose2& at(std::size_t keyframe, Ancestry::Index particle) const {
      return poses[index(keyframe, particle)];
    }
    void keep(std::span<const Ancestry::Run> survivors);

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.epoch, self.particles, self.poses);
    }
  };
  struct Step {
    Motion since_keyframe;
    bool is_keyframe = false;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.since_keyframe, self.is_keyframe);
    }
  };

  [[nodiscard]] std::vector<Pose2> keyframes_of(Ancestry::Index particle, const Ancestry& ancestry) const;

  std::vector<Step> steps_;
  std::vector<Pose2> common_;
  std::deque<Segment> segments_;
  std::vector<FrameCovariance> drifts_;  ///< up to each keyframe
};

}  // namespace trundle::slam
