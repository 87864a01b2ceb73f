#pragma once

#include <deque>
#include <vector>

#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/columns.hpp"

namespace trundle::slam {

/// The whole path of every particle that is alive. What all of them share, everything up to their last common
/// ancestor, is stored once; above it only what somebody descends from. Poses are drawn at keyframes, where
/// something was seen; steps between two keyframes are the same for all particles but for where they ended
/// up.
class ParticlePaths {
 public:
  /// Whether paths are kept at all: without, memory does not grow with time.
  explicit ParticlePaths(bool keeps = true) : keeps_(keeps) {}

  /// A step.
  void add(const Motion& motion);
  /// Something was seen at the end of the last one: every particle's pose there.
  void add_keyframe(const PoseColumns& poses, Ancestry& ancestry);
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
    archive(self.since_keyframe_, self.steps_, self.common_, self.segments_);
  }

 private:
  /// The keyframes of one epoch.
  struct Segment {
    Ancestry::Epoch epoch = 0;
    std::vector<Ancestry::Index> particles;  ///< whose poses are kept, ascending
    std::vector<Pose2> poses;                ///< keyframe by keyframe

    [[nodiscard]] std::size_t keyframes() const { return poses.size() / particles.size(); }
    [[nodiscard]] const Pose2& at(std::size_t keyframe, Ancestry::Index particle) const;
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

  bool keeps_;
  Motion since_keyframe_;
  std::vector<Step> steps_;
  std::vector<Pose2> common_;
  std::deque<Segment> segments_;
};

}  // namespace trundle::slam
