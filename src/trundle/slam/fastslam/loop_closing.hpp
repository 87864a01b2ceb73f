#pragma once

#include <deque>
#include <map>
#include <optional>
#include <span>

#include "trundle/slam/fastslam/loop_correction.hpp"
#include "trundle/slam/report.hpp"

namespace trundle::slam {

/// A landmark that was last seen long ago, and where it is seen now.
struct Revisit {
  LandmarkId landmark = kUnknownLandmark;
  Vector2 seen = Vector2::Zero();             ///< in the world, from where the robot is taken to be
  Matrix2 seen_covariance = Matrix2::Zero();  ///< of the reading
  Vector2 mapped = Vector2::Zero();           ///< where the map has it
  Matrix2 mapped_covariance = Matrix2::Zero();
  Submap seen_in = {};                  ///< that in view when it was last seen
  Vector2 seen_from = Vector2::Zero();  ///< where the robot is taken to be

  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.landmark, self.seen, self.seen_covariance, self.mapped, self.mapped_covariance, self.seen_in,
            self.seen_from);
  }
};

/// The move that takes what is seen to where it is mapped, most probably: `prior` is the covariance of its
/// twist about the centre, before anything is seen. docs/theory/loop-closing.md, eq. 64.
[[nodiscard]] LoopCorrection::Move rigid_fit(std::span<const Revisit> revisits, const Vector2& centre,
                                             const Matrix3& prior);

/// Keeps sightings of landmarks that are rejected although the covariance of the map frame explains where
/// they are seen, until there are enough to fit the drift. docs/theory/loop-closing.md.
class LoopClosing {
 public:
  /// A step with sightings has come.
  void next_keyframe();
  /// Its number.
  [[nodiscard]] std::uint64_t keyframe() const { return keyframe_; }
  /// Whether it was not in view lately.
  [[nodiscard]] bool is_old(const Submap& submap) const;
  /// A rejected sighting of an old landmark.
  void add_rejected(const Revisit& revisit, const Submap& now);
  /// One that fits: the loop is closed already, or what is rejected is wrong.
  void add_matched(const Revisit& revisit, const Submap& now);
  /// A landmark fits that was in view lately: if it was revisited, it still counts as such.
  void still_matched(LandmarkId landmark);
  /// Whether old landmarks that were revisited are where they are mapped, but for a few.
  [[nodiscard]] bool is_closed() const;
  /// Whether this step has rejected one that drift explains.
  [[nodiscard]] bool has_evidence() const { return has_evidence_; }
  /// The correction of the map, where what has been rejected lately agrees on one move. Nothing is kept then.
  std::optional<LoopCorrection> close(const Submap& now);

  /// Its state, for io/archive.hpp.
  template <class Archive, class Self>
  static void persist(Archive& archive, Self& self) {
    archive(self.window_, self.revisited_, self.keyframe_);
  }

 private:
  struct Sighting {
    Revisit revisit;
    std::uint64_t keyframe = 0;
    bool explained_by_drift = false;  ///< and not without it

    template <class Archive, class Self>
    static void persist(Archive& archive, Self& self) {
      archive(self.revisit, self.keyframe, self.explained_by_drift);
    }
  };
  [[nodiscard]] bool has_parallax(const Revisit& revisit) const;
  void store(const Revisit& revisit, bool explained_by_drift);

  /// Old landmarks that fit, and at which keyframe they did last.
  std::map<LandmarkId, std::uint64_t> revisited_;
  std::deque<Sighting> window_;
  std::uint64_t keyframe_ = 0;
  bool has_evidence_ = false;  ///< of drift, in this step
};

}  // namespace trundle::slam
