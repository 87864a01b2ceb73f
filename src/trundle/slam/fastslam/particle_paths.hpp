#pragma once

#include <deque>
#include <vector>

#include "trundle/slam/fastslam/ancestry.hpp"
#include "trundle/slam/fastslam/loop_correction.hpp"
#include "trundle/slam/motion.hpp"

namespace trundle {

/// The whole path of every particle that is alive. What all of them share, everything up to their last common
/// ancestor, is stored once; above it only what somebody descends from. Poses are drawn at stations, where
/// something was seen; steps between two stations are the same for all particles but for where they ended up.
class ParticlePaths {
 public:
  /// A step without sightings: how the body has moved since the last station.
  void propagate(const Motion& since_station);
  /// A station: every particle's pose, `since_station` after the one before. `ancestry` is that of them all;
  /// `drift`: what the odometry may have erred by up to it.
  void add_keyframe(const Motion& since_station, std::span<const Pose2> poses, Ancestry& ancestry,
                    const FrameCovariance& drift);
  /// Every station by its share.
  void bend(const LoopCorrection& bend, const Twists& twists, const Ancestry& ancestry);
  /// After ancestry.resample().
  void resampled(Ancestry& ancestry);

  /// Poses of all steps, from `start`, for a particle with these systematic errors; between stations as is
  /// most probable given both. docs/theory/fastslam.md, eq. 18.
  struct Query {
    Ancestry::Index particle = 0;
    Pose2 start = {};
    Systematic systematic = {};
  };
  std::vector<Pose2> path_of(const Query& query, const Ancestry& ancestry) const;
  /// How many of the particles at the station so many before the last have descendants; 1: all are of one.
  std::size_t ancestors(std::size_t stations_back, const Ancestry& ancestry) const;
  /// Poses stored: for tests of what it costs.
  std::size_t stored() const;

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.steps_, self.common_, self.segments_, self.drifts_);
  }

 private:
  /// The stations of one epoch.
  struct Segment {
    Ancestry::Epoch epoch = 0;
    std::vector<Ancestry::Index> particles;  ///< whose poses are kept, ascending
    std::vector<Pose2> poses;                ///< station by station

    std::size_t stations() const { return poses.size() / particles.size(); }
    /// Of a pose.
    std::size_t index(std::size_t station, Ancestry::Index particle) const;
    const Pose2& at(std::size_t station, Ancestry::Index particle) const {
      return poses[index(station, particle)];
    }
    void keep(std::span<const Ancestry::Run> survivors);

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.epoch, self.particles, self.poses);
    }
  };
  struct Step {
    Motion since_station;
    bool is_station = false;

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.since_station, self.is_station);
    }
  };

  std::vector<Pose2> stations_of(Ancestry::Index particle, const Ancestry& ancestry) const;

  std::vector<Step> steps_;
  std::vector<Pose2> common_;
  std::deque<Segment> segments_;
  std::vector<FrameCovariance> drifts_;  ///< up to each station
};

}  // namespace trundle
